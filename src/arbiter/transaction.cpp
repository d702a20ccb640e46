// What a transaction came to: a reply, damage, silence, and what was heard besides.

#include <algorithm>
#include <utility>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

Arbiter::Arbiter(Settings settings)
    : settings_(std::move(settings)), queue_(settings_.queue), echo_memory_(settings_.echo) {
    for (const StationSettings& station : settings_.stations) {
        configured_[station.id] = station;
        counters_[station.id];
    }
    counters_[kUnlisted];
    settings_.end_of_frame = std::max(settings_.end_of_frame, silent_interval(settings_.serial));
}

void Arbiter::on_line_up(TimePoint now) {
    up_ = true;
    // The receiver's first state: one silent interval before the first frame (MST-01).
    quiet_since_ = now;
    quiet_until_ = now;
    last_station_ = kBroadcast;
    early_replies_ = 0;
    timely_replies_ = 0;
    echo_memory_.forget();
    echo_ = {};
    step(now);
}

void Arbiter::on_line_down(TimePoint now) {
    up_ = false;
    idle_heard_.clear();
    cache_.clear();
    if (active_) {
        Group group = std::move(active_->group);
        note_unused(now, active_->framer.take_unused());
        close_active(now, group);
        for (const Job& job : group.jobs) finish(job, Fault::line_lost);
    }
    for (const Group& group : std::exchange(retries_, {})) {
        for (const Job& job : group.jobs) finish(job, Fault::line_lost);
    }
    for (const Job& job : queue_.remove_if([](const Job&) { return true; })) {
        finish(job, job.attempts > 0 ? Fault::line_lost : Fault::line_down);
    }
}

/// Bytes are there that more bytes or silence will judge.
bool Arbiter::is_hearing() const {
    return active_->framer.has_pending() || echo_.pending() || !active_->collided.empty();
}

/// When the transaction on the wire must be looked at again.
TimePoint Arbiter::active_deadline() const {
    const Active& a = *active_;
    if (a.group.station == kBroadcast) return a.sent;
    if (!is_hearing()) return a.give_up;
    // Something is being heard: its silence decides, also after give_up, but not for ever.
    return std::min(std::max(a.sent, a.last_byte) + settings_.end_of_frame, a.longest);
}

void Arbiter::check_active(TimePoint now) {
    if (!active_ || now < active_deadline()) return;
    if (active_->group.station == kBroadcast) {
        check_broadcast(now);
        return;
    }
    if (!active_->collided.empty()) {
        fail_attempt(now, Fault::damaged);
        return;
    }
    std::optional<Bytes> reply;
    if (const Bytes held = echo_.release(); !held.empty()) reply = active_->framer.feed(held);
    if (!reply) reply = active_->framer.on_silence();
    if (reply) {
        settle(now, *reply);
    } else if (active_->framer.was_damaged()) {
        fail_attempt(now, Fault::damaged);
    } else if (now >= active_->give_up) {
        fail_attempt(now, Fault::timeout);
    }
}

/// The last bit of a broadcast has left: nobody answers, the line rests for the turnaround.
void Arbiter::check_broadcast(TimePoint now) {
    const Group group = std::move(active_->group);
    const TimePoint sent = active_->sent;
    close_active(now, group);
    quiet_until_ = sent + settings_.broadcast_turnaround;
    for (const Job& job : group.jobs) finish(job, modbus::normal_write_reply(job.pdu));
}

void Arbiter::settle(TimePoint now, const Bytes& reply) {
    count_reply(now, reply);
    const std::vector<modbus::Unused> unused = active_->framer.take_unused();
    if (!echo_.complete()) {
        echo_memory_.on_reply_without_echo(active_->group.pdu, active_->clean && unused.empty());
    }
    count_strays(unused);
    note_unused(now, unused);
    Group group = std::move(active_->group);
    const TimePoint sent = active_->sent;
    actions_.push_back(Note{
        now, Note::Direction::received, modbus::encode_adu(group.station, reply), "reply", {}});
    close_active(now, group);
    if (group.span && !modbus::exception_of(reply) &&
        settings_of(group.station).max_age > Duration::zero()) {
        cache_.store(*group.span, reply, group.started);
    }
    Station& station = station_of(group.station);
    // Each attempt may be answered, and nobody knows which one this reply was for.
    if (station.owed > 0) expect_late(now, station, sent);
    station.copies.on_reply(now, reply);
    station.not_before = std::max(station.not_before, now + station.copies.hold());
    if (!split(group, reply)) deliver(group, reply);
}

void Arbiter::count_reply(TimePoint now, const Bytes& reply) {
    const Active& a = *active_;
    StationCounters& counters = counters_of(a.group.station);
    Station& station = station_of(a.group.station);
    const bool early = a.first_byte < a.sent + silent_interval(settings_.serial);
    ++(early ? early_replies_ : timely_replies_);
    const Duration reply_time = wire_time(settings_.serial, reply.size() + kAduOverhead);
    const Duration think =
        std::max(now - a.sent - reply_time - silent_interval(settings_.serial), Duration::zero());
    count_answered(reply.size() + kAduOverhead);
    counters.turnaround.observe(think);
    counters.bus_transaction.observe(now - a.started);
    station.slowest = std::max(station.slowest, think);
    station.turnaround.add(think);
    station.adaptive.on_reply();
    if (station.drift.check(station.turnaround, station.settings.response_timeout)) {
        actions_.push_back(StationEvent{StationEvent::Kind::drift, a.group.station,
                                        station.turnaround.quantile(0.95)});
    }
    slowest_ = std::max(slowest_.value_or(think), think);
    const auto code = modbus::exception_of(reply);
    if (code) ++counters.exceptions[*code];
    const bool cheaper =
        station.probe.empty() || a.group.span->count < read_span(0, station.probe)->count;
    if (!code && a.group.span && cheaper) station.probe = a.group.pdu;
    if (station.health.on_reply(now)) {
        actions_.push_back(StationEvent{StationEvent::Kind::online, a.group.station, {}});
    }
}

/// A panel that refuses a joined read may take the parts: they go again, each for itself, and the
/// join is remembered. True when that is so; those who asked for the whole have their answer.
bool Arbiter::split(Group& group, const Bytes& reply) {
    const auto code = modbus::exception_of(reply);
    const bool about_range = code && (*code == 2 || *code == 3);
    const auto asked_all = [&](const Job& job) { return job.pdu == group.pdu; };
    if (!about_range || std::all_of(group.jobs.begin(), group.jobs.end(), asked_all)) return false;
    if (std::none_of(group.jobs.begin(), group.jobs.end(), asked_all)) {
        constexpr std::size_t kRemembered = 64;
        if (refused_spans_.size() >= kRemembered) refused_spans_.erase(refused_spans_.begin());
        refused_spans_.push_back(*group.span);
    }
    for (auto job = group.jobs.rbegin(); job != group.jobs.rend(); ++job) {
        if (asked_all(*job)) {
            finish(*job, reply);
            continue;
        }
        job->alone = true;
        queue_.put_back(std::move(*job));
    }
    return true;
}

void Arbiter::deliver(const Group& group, const Bytes& reply) {
    const bool exception = modbus::exception_of(reply).has_value();
    for (const Job& job : group.jobs) {
        const bool shared = &job != &group.jobs.front();
        if (exception || job.pdu == group.pdu) {
            finish(job, reply, shared);
        } else {
            finish(job, slice_reply(*group.span, reply, *read_span(job.station, job.pdu)), shared);
        }
    }
}

void Arbiter::fail_attempt(TimePoint now, Fault fault) {
    const std::vector<modbus::Unused> unused = active_->framer.take_unused();
    count_failed(unused);
    note_unused(now, unused);
    if (!active_->collided.empty())
        note_unused(now, modbus::classify_heard(active_->collided, kBroadcast));
    Group group = std::move(active_->group);
    Station& station = station_of(group.station);
    const Duration cost = now - active_->started + gap_of(group.station);
    const TimePoint sent = active_->sent;
    const bool collided = !active_->collided.empty();
    close_active(now, group);
    if (fault == Fault::damaged) {
        ++counters_of(group.station).damaged_frames;
    } else {
        station.adaptive.on_timeout();
    }
    if (fault != Fault::damaged || collided) {
        ++station.owed;
        station.unanswered = group.pdu;
    }
    if (station.owed > 0) quarantine(now, group, station, sent);
    if (station.health.offline()) budget_.spend(now, cost);
    if (may_retry(now, group, station)) {
        other_first_ = settings_.quarantine == Quarantine::station;
        retries_.push_back(std::move(group));
        return;
    }
    give_up(now, group, fault);
}

/// No further attempt: everybody is answered, and the station judged.
void Arbiter::give_up(TimePoint now, const Group& group, Fault fault) {
    for (const Job& job : group.jobs) finish(job, fault);
    if (group.learns_for != 0 && fault == Fault::damaged) echo_memory_.on_unclear();
    if (group.learns_for != 0 && fault != Fault::damaged) {
        // P8: the write never left, and its station is silent.
        const auto asked = [&](const Job& job) { return job.ticket == group.learns_for; };
        for (const Job& job : queue_.remove_if(asked)) finish(job, fault);
    }
    Station& station = station_of(group.station);
    if (fault == Fault::damaged && !station.health.offline()) {
        station.health.on_damaged();
    } else {
        went_silent(now, group, station);
    }
}

/// P1: until the reply can no longer come, only the same request may go again. A probe lets the
/// others go on: its station is known to be silent, and its address tells a late reply apart. A
/// timeout that was chosen short (adaptive) frees the others early, but not this station: it may
/// still answer within the whole one.
void Arbiter::quarantine(TimePoint now, const Group& group, Station& station, TimePoint sent) {
    expect_late(now, station, sent);
    if (settings_.quarantine != Quarantine::station && !group.probe) {
        const bool early = station.settings.adaptive_timeout;
        const TimePoint others = early ? now + station.timeout() : station.not_before;
        quarantined_until_ = std::max(quarantined_until_, std::min(others, station.not_before));
        explain_quarantine(now, group);
    }
}

/// This station owes a reply, the last one to a request that left at `sent`: nothing else of this
/// shape until it can no longer come.
void Arbiter::expect_late(TimePoint now, Station& station, TimePoint sent) {
    station.due = sent + station.timeout();
    station.not_before =
        std::max(now, sent + station.settings.response_timeout) + station.late.value();
}

void Arbiter::went_silent(TimePoint now, const Group& group, Station& station) {
    if (!station.health.on_silence(now)) return;
    actions_.push_back(StationEvent{StationEvent::Kind::offline, group.station, {}});
    for (const Job& job :
         queue_.remove_if([&](const Job& j) { return j.station == group.station; })) {
        finish(job, Fault::offline);
    }
}

bool Arbiter::may_retry(TimePoint now, const Group& group, const Station& station) const {
    if (group.jobs.empty() || station.health.offline()) return false;
    const bool harmless = modbus::is_pure_read(group.pdu) || station.settings.retry_writes;
    const bool in_time = std::any_of(group.jobs.begin(), group.jobs.end(),
                                     [&](const Job& job) { return now < job.start_by; });
    return harmless && in_time && group.attempts <= station.settings.retries;
}

void Arbiter::close_active(TimePoint now, const Group& group) {
    const TimePoint end =
        std::max({active_->sent, active_->last_byte, std::min(now, active_->longest)});
    const Duration busy = end - active_->started + gap_of(group.station);
    line_counters_.busy += busy;
    for (const Job& job : group.jobs)
        shares_.add(job.client, busy / static_cast<int>(group.jobs.size()));
    active_.reset();
}

void Arbiter::finish(const Job& job, Result<Bytes> pdu, bool shared) {
    actions_.push_back(Finish{job.ticket, std::move(pdu), job.attempts > 0, shared, {}});
}

std::optional<Action> Arbiter::poll_action() {
    if (actions_.empty()) return std::nullopt;
    Action action = std::move(actions_.front());
    actions_.pop_front();
    return action;
}

/// Request, gap, and the shortest thing a station can say.
Duration Arbiter::shortest_transaction(const Job& job) const {
    const std::size_t request = job.pdu.size() + kAduOverhead;
    if (job.station == kBroadcast) return wire_time(settings_.serial, request);
    return wire_time(settings_.serial, request + kShortestReplyAdu) +
           silent_interval(settings_.serial);
}

const StationSettings& Arbiter::settings_of(std::uint8_t station) const {
    const auto found = configured_.find(station);
    return found == configured_.end() ? settings_.unlisted : found->second;
}

Arbiter::Station& Arbiter::station_of(std::uint8_t id) {
    const auto found = stations_.find(id);
    if (found != stations_.end()) return found->second;
    const StationSettings& settings = settings_of(id);
    return stations_.try_emplace(id, settings, settings_.offline).first->second;
}

StationHealth Arbiter::health(std::uint8_t id) const {
    const auto found = stations_.find(id);
    return found == stations_.end() ? StationHealth(settings_.offline) : found->second.health;
}

Duration Arbiter::response_timeout(std::uint8_t id) const {
    const auto found = stations_.find(id);
    return found == stations_.end() ? settings_of(id).response_timeout : found->second.timeout();
}

StationCounters& Arbiter::counters_of(std::uint8_t station) {
    const auto found = counters_.find(station);
    return found == counters_.end() ? counters_[kUnlisted] : found->second;
}

Duration Arbiter::gap_of(std::uint8_t station) const {
    return std::max(settings_of(station).frame_gap, silent_interval(settings_.serial));
}

}  // namespace panelgate::arbiter
