#include "panelgate/arbiter/arbiter.hpp"

#include <algorithm>
#include <utility>

#include "explain.hpp"
#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

using Kind = StationEvent::Kind;

Arbiter::Arbiter(Settings settings)
    : settings_(std::move(settings)),
      stations_(settings_),
      schedule_(settings_),
      quiet_(wire_time(settings_.serial, modbus::kMaxRtuAdu), silent_interval(settings_.serial)),
      strays_(settings_.serial),
      reception_(settings_),
      echo_memory_(settings_.echo),
      ledger_(settings_) {
    settings_.end_of_frame = std::max(settings_.end_of_frame, silent_interval(settings_.serial));
    settings_.reply_hole = std::max(settings_.reply_hole, settings_.end_of_frame);
}

Result<Ticket> Arbiter::submit(TimePoint now, Job job) {
    if (!up_ || resetting_) return Fault::line_down;
    // Not while the client has something open there: it must not read older than its own write.
    const bool waits = schedule_.backlog().has(job.client, job.station);
    const bool open = waits || (active_ && active_->group().has(job.client, job.station));
    const Duration max_age = open ? Duration::zero() : stations_.settings(job.station).max_age;
    if (auto known = reception_.from_memory(now, job, max_age)) {
        ledger_.finish_from_memory(known->ticket, std::move(known->hit.pdu), known->hit.age);
        return known->ticket;
    }
    if (stations_.refuses(now, job)) {
        ledger_.decide(now, [&] { return explain::offline(now, job, health(job.station)); });
        return Fault::offline;
    }
    reception_.stamp(now, job);
    job.alone = job.alone || !settings_.share_reads;
    const Ticket ticket = job.ticket;
    if (active_ && !waits && active_->takes_along(now, job)) {
        job.attempts = 1;
        ledger_.on_started(now, job);
        active_->group().jobs.push_back(std::move(job));
        return ticket;
    }
    const JobQueue::Admission admission = schedule_.backlog().queue().push(job);
    for (const Job& shed : admission.shed) {
        ledger_.decide(now, [&] { return explain::shed(shed); });
        const bool sent = shed.attempts > 0;  // in a joined read that did not come about
        ledger_.finish(shed, sent ? Fault::timeout : Fault::busy);
    }
    if (!admission.taken) {
        ledger_.decide(now, [&] { return explain::full(job, settings_.queue, queue_depth()); });
        return Fault::busy;
    }
    step(now);
    return ticket;
}

void Arbiter::cancel(TimePoint now, Client client) {
    ledger_.on_client_gone(client);
    for (const Job& job : schedule_.backlog().cancel(client)) ledger_.finish(job, Fault::cancelled);
    if (active_) active_->group().on_gone(client);
    step(now);
}

void Arbiter::on_line_up(TimePoint now) {
    up_ = true;
    resetting_ = false;
    proved_ = now;
    quiet_.on_open(now);
    stations_.on_back();
    if (settings_.may_stall) stations_.on_proved(now, now);
    pace_ = {};
    echo_memory_.forget();
    step(now);
}

/// What was sent is owed all the same: a device server may hand it to the next connection.
void Arbiter::on_line_down(TimePoint now) {
    up_ = false;
    resetting_ = false;
    strays_.forget();
    reception_.memory().clear();
    if (active_) {
        note(now, active_->take_strays());
        const Attempt attempt = take_active(now);
        const Group& group = attempt.group();
        if (!attempt.is_broadcast())
            stations_.of(group.station).owe(now, group.pdu, attempt.timing().sent);
        for (const Job& job : group.jobs) ledger_.finish(job, Fault::line_lost);
    }
    for (const Job& job : schedule_.backlog().clear())
        ledger_.finish(job, job.attempts > 0 ? Fault::line_lost : Fault::line_down);
}

void Arbiter::on_rx(TimePoint now, ByteView bytes) {
    if (bytes.empty() || !up_) return;
    expire_active(now);
    if (!active_ || active_->is_broadcast()) {
        hear_idle(now, bytes);
    } else {
        const bool was_wrong = active_->echo().mismatch();
        const Verdict verdict = active_->on_rx(now, bytes, ends_attempt(now));
        quiet_.on_heard(std::max(active_->timing().sent, now));
        if (active_->echo().mismatch() && !was_wrong) {
            ledger_.on_echo_mismatch(now, active_->group().station);
            echo_memory_.on_mismatch();
        }
        if (const Bytes stale = active_->take_stale(); !stale.empty()) hear_idle(now, stale);
        conclude(now, verdict);
    }
    step(now);
}

void Arbiter::on_end(TimePoint now, Duration left) {
    if (!wants_end(now)) return;
    active_->on_end(now, left);
    quiet_.on_heard(active_->timing().sent);
}

void Arbiter::step(TimePoint now) {
    check_active(now);
    expire(now);
    if (!active_ && strays_.pending() && now >= quiet_.since() + settings_.end_of_frame)
        judge_idle(now);
    while (up_ && !resetting_ && !active_ && start_next(now)) check_active(now);
}

void Arbiter::check_active(TimePoint now) {
    if (!active_ || now < active_->deadline()) return;
    if (active_->is_broadcast()) return end_broadcast(now);
    conclude(now, active_->on_deadline(now, ends_attempt(now)));
}

void Arbiter::conclude(TimePoint now, Verdict verdict) {
    const std::vector<modbus::Unused> strays = active_->take_strays();
    ledger_.inside_attempt(true);
    if (verdict == Verdict::replied) settle(now);
    note(now, strays);
    if (verdict != Verdict::open && verdict != Verdict::replied) fail(now, verdict);
    ledger_.inside_attempt(false);
}

/// The last bit of a broadcast has left: nobody answers, the line rests for the turnaround.
void Arbiter::end_broadcast(TimePoint now) {
    const Attempt attempt = take_active(now);
    quiet_.rest_until(attempt.timing().sent + settings_.broadcast_turnaround + latency_);
    for (const Job& job : attempt.group().jobs)
        ledger_.finish(job, modbus::normal_write_reply(job.pdu));
}

/// The reply is there.
void Arbiter::settle(TimePoint now) {
    Station& station = stations_.of(active_->group().station);
    const bool early = active_->replied_early();
    const bool too_early = early && !settings_.paced && pace_.believed();
    if (station.is_copy(now, *active_, too_early)) return active_->reject_reply();
    if (station.may_be_copy(now, *active_)) {
        const bool again = station.repeats_itself(now, *active_) &&
                           active_->group().attempts == 1 && station.may_retry(active_->group());
        return active_->hold_reply(station.needed(), again);
    }
    pace_.on_reply(early);
    Attempt attempt = take_active(now);
    Group& group = attempt.group();
    const Bytes& reply = attempt.reply();
    const Duration waited = attempt.waited(now);
    const Duration think = std::max(waited - silent_interval(settings_.serial), Duration::zero());
    const Duration needed = attempt.first_sign(now);
    const Station::Replied replied = station.on_reply(now, attempt, needed, think);
    const bool tells = group.silent_after == Duration::zero();
    stations_.on_reply(now, tells ? std::optional(needed) : std::nullopt);
    if (replied.back) stations_.on_back();
    if (settings_.may_stall) stations_.on_proved(now, attempt.timing().started);
    proved_ = std::max(proved_, attempt.timing().started);
    strays_.on_replied(group.station);
    quiet_.rest_until(station.trail_until());
    ledger_.on_answered(now, attempt, think, replied);
    attempt.teach(echo_memory_);
    const bool exception = modbus::exception_of(reply).has_value();
    if (group.span && !exception && station.settings().max_age > Duration::zero())
        reception_.memory().store(*group.span, reply, group.started);
    if (exception) schedule_.give_back(group);
    for (const Job& job : group.jobs)
        ledger_.finish(job, Sharing::part_for(group, reply, job), &job != &group.jobs.front());
}

void Arbiter::fail(TimePoint now, Verdict verdict) {
    Attempt attempt = take_active(now);
    ledger_.on_failed(attempt, verdict);
    Group& group = attempt.group();
    Station& station = stations_.of(group.station);
    const TimePoint sent = attempt.timing().sent;
    const Duration cost = now - attempt.timing().started + stations_.gap(group.station);
    station.owe(now, group.pdu, sent);
    stations_.on_failed(now, group.station, verdict, cost);
    if (const auto until = schedule_.line_rests_until(now, group, sent, station)) {
        quiet_.quarantine(group.station, *until);
        station.on_line_rests(now, *until - now);
        ledger_.decide(now, [&] { return explain::line_rests(*until - now, group); });
    }
    group.silent_after = verdict == Verdict::silent
                             ? std::min(now - sent, attempt.timing().patience) - latency_
                             : Duration::zero();
    const bool in_time =
        std::ranges::any_of(group.jobs, [&](const Job& job) { return now < job.start_by; });
    if (in_time && station.may_retry(group) && stations_.affords_retry(now, station)) {
        station.on_retry(verdict == Verdict::silent);
        schedule_.retry(std::move(group), stations_.patience(now, group));
    } else if (group.joined()) {
        station.on_retry(verdict == Verdict::silent);
        schedule_.give_back(group);  // nobody's health: the panel may only not take the length
    } else {
        give_up(now, group, verdict == Verdict::silent ? Fault::timeout : Fault::damaged);
    }
}

/// No further attempt: everybody is answered, and the station judged.
void Arbiter::give_up(TimePoint now, const Group& group, Fault fault) {
    for (const Job& job : group.jobs) ledger_.finish(job, fault);
    Backlog& backlog = schedule_.backlog();
    if (group.learns_for != 0 && fault == Fault::damaged) echo_memory_.on_unclear();
    if (group.learns_for != 0 && fault != Fault::damaged) {
        // P8: the write never left, and its station is silent.
        const auto asked = [&](const Job& job) { return job.ticket == group.learns_for; };
        for (const Job& job : backlog.remove_if(asked)) ledger_.finish(job, fault);
    }
    Station& station = stations_.of(group.station);
    if (!station.on_given_up(now, fault)) return;
    if (!station.stranger()) ledger_.event(Kind::offline, group.station);
    const auto theirs = [&](const Job& job) { return job.station == group.station; };
    for (const Job& job : backlog.remove_if(theirs)) ledger_.finish(job, Fault::offline);
}

/// The attempt is over: its time is accounted for, and what the echo filter held back is heard.
Attempt Arbiter::take_active(TimePoint now) {
    Attempt attempt = std::move(*active_);
    active_.reset();
    ledger_.on_ended(now, attempt, stations_.gap(attempt.group().station));
    if (attempt.echoed() && echo_memory_.on_echo(attempt.group().pdu))
        ledger_.event(Kind::echo, attempt.group().station);
    // Where a reply may come before the request has left, early bytes tell nothing.
    const bool keeps_pace = settings_.paced || pace_.believed();
    if (const auto noise = attempt.early_noise(); noise && keeps_pace)
        stations_.on_trail(*noise, strays_.replied_before());
    strays_.hear(attempt.release_echo());
    return attempt;
}

void Arbiter::expire(TimePoint now) {
    expire_active(now);
    for (const Job& job : schedule_.backlog().expire(now)) {
        const bool sent = job.attempts > 0;
        ledger_.decide(now, [&] { return explain::expired(now, job, sent); });
        ledger_.finish(job, sent ? Fault::timeout : Fault::expired);
    }
}

/// Those of the transaction whose own deadline has come; the others go on waiting for its reply. A
/// broadcast that is leaving is answered when it has left.
void Arbiter::expire_active(TimePoint now) {
    if (!active_ || active_->is_broadcast()) return;
    for (const Job& job : active_->group().expire(now)) ledger_.finish(job, Fault::timeout);
}

Attempt::Ends Arbiter::ends_attempt(TimePoint now) const {
    return [this, now](ByteView adu) { return strays_.is_wrong_reply(now, adu, stations_); };
}

void Arbiter::hear_idle(TimePoint now, ByteView bytes) {
    quiet_.on_noise(now);
    strays_.hear(bytes);
    if (strays_.full()) judge_idle(now);
}

void Arbiter::judge_idle(TimePoint now) { note(now, strays_.take(quiet_.station())); }

void Arbiter::note(TimePoint now, const std::vector<modbus::Unused>& parts) {
    const bool idle = !active_;
    strays_.note(now, parts, idle, stations_, quiet_, ledger_);
}

bool Arbiter::start_next(TimePoint now) {
    if (now < quiet_.free_at(stations_.gap(quiet_.station()))) return false;
    if (strays_.pending()) judge_idle(now);  // it may tell that the line is not free
    Schedule::Next next = schedule_.next(now, stations_, quiet_, echo_memory_, proved_);
    if (next.new_way) {
        resetting_ = true;
        ledger_.reset("nothing was answered since a request: it may still be on its way");
    }
    if (!next.group) return false;
    start(now, std::move(*next.group));
    return true;
}

void Arbiter::start(TimePoint now, Group group) {
    Bytes adu = modbus::encode_adu(group.station, group.pdu);
    if (++group.attempts == 1) group.started = now;
    for (Job& job : group.jobs) {
        if (job.attempts++ == 0) ledger_.on_started(now, job);
    }
    Attempt::Timing timing = Attempt::timing_of(settings_, now, adu.size(), lead_);
    timing.pause = now - quiet_.since();
    timing.confirm_end = confirm_ends_;
    if (group.station != kBroadcast) {
        Station& station = stations_.of(group.station);
        station.on_asked(now, group, settings_.may_stall && station.doubtful(proved_));
        if (group.attempts == 1)
            group.first_silence =
                !station.suspect() && !station.health().offline() && !stations_.spent(now, station);
        timing.patience = stations_.patience(now, group) + latency_;
        timing.usual = std::min(station.usual() + latency_, timing.patience);
    }
    if (!modbus::is_pure_read(group.pdu))
        reception_.memory().on_write(now, group.station, group.pdu);
    std::string why;
    if (ledger_.explains()) why = explain::start(now, group, schedule_.backlog().queue());
    quiet_.on_sent(timing.sent, group.station);
    strays_.on_sent(adu);
    const EchoFilter echo(adu, echo_memory_.expect(group.pdu));
    active_.emplace(std::move(group), timing, echo);
    ledger_.transmit(now, *active_, std::move(adu), why);
}

std::optional<TimePoint> Arbiter::next_deadline() const {
    std::optional<TimePoint> next = schedule_.backlog().first_expiry();
    const auto earlier = [&next](TimePoint t) { next = next ? std::min(*next, t) : t; };
    if (active_) {
        earlier(std::min(active_->deadline(), active_->end_wanted_at()));
        for (const Job& job : active_->group().jobs) {
            if (!active_->is_broadcast()) earlier(job.deadline);
        }
        return next;
    }
    if (strays_.pending()) earlier(quiet_.since() + settings_.end_of_frame);
    if (!up_ || resetting_) return next;
    if (const auto start = schedule_.next_start(stations_, quiet_)) earlier(*start);
    return next;
}

}  // namespace panelgate::arbiter
