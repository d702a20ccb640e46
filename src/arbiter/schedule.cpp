// What a line does next: which request, when, and together with which others.

#include <algorithm>
#include <utility>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

Result<Ticket> Arbiter::submit(TimePoint now, Job job) {
    if (!up_) return Fault::line_down;
    if (const auto ticket = answer_from_memory(now, job)) return *ticket;
    if (queue_.full(job.client)) {
        explain_refusal(now, job, Fault::busy);
        return Fault::busy;
    }
    if (job.station != kBroadcast) {
        StationHealth& health = station_of(job.station).health;
        const bool may_wake = !modbus::is_pure_read(job.pdu) && health.offline();
        if (health.offline() && !(may_wake && health.take_half_open(now))) {
            explain_refusal(now, job, Fault::offline);
            return Fault::offline;
        }
    }
    job.ticket = ++last_ticket_;
    job.arrived = now;
    job.deadline = now + settings_.queue.deadline;
    job.start_by = job.deadline - shortest_transaction(job);
    const Ticket ticket = job.ticket;
    const bool first_of_client = !queue_.has(job.client);
    // Not a repeated one: an answer to the first attempt may still come, and would be too old.
    const bool request_still_leaving =
        active_ && now < active_->sent && active_->group.attempts == 1;
    if (request_still_leaving && first_of_client && contained_in(active_->group.span, job) &&
        active_->group.jobs.size() < settings_.queue.limit) {
        job.attempts = 1;
        active_->group.jobs.push_back(std::move(job));
    } else {
        queue_.push(std::move(job));
    }
    step(now);
    return ticket;
}

/// A value that was read lately, where the station's max_age allows it. Not for polls, which are to
/// bring new ones, and not while the client has something open: it must not read older than its own
/// write.
std::optional<Ticket> Arbiter::answer_from_memory(TimePoint now, const Job& job) {
    const Duration max_age = settings_of(job.station).max_age;
    if (max_age <= Duration::zero() || job.priority == PriorityClass::poll) return std::nullopt;
    const auto span = read_span(job.station, job.pdu);
    if (!span || has_open(job.client)) return std::nullopt;
    auto hit = cache_.find(*span, now, max_age);
    if (!hit) return std::nullopt;
    Finish answer;
    answer.ticket = ++last_ticket_;
    answer.pdu = std::move(hit->pdu);
    answer.age = hit->age;
    actions_.push_back(std::move(answer));
    return last_ticket_;
}

bool Arbiter::has_open(Client client) const {
    const auto theirs = [&](const Job& job) { return job.client == client; };
    const auto in = [&](const Group& group) {
        return std::any_of(group.jobs.begin(), group.jobs.end(), theirs);
    };
    return queue_.has(client) || (active_ && in(active_->group)) ||
           std::any_of(retries_.begin(), retries_.end(), in);
}

void Arbiter::cancel(TimePoint now, Client client) {
    shares_.forget(client);
    const auto theirs = [&](const Job& job) { return job.client == client; };
    for (const Job& job : queue_.remove_if(theirs)) finish(job, Fault::cancelled);
    for (Group& group : retries_) {
        for (const Job& job : group.jobs) {
            if (theirs(job)) finish(job, Fault::cancelled);
        }
        std::erase_if(group.jobs, theirs);
    }
    forget_empty_retries();
    step(now);
}

void Arbiter::on_deadline(TimePoint now) { step(now); }

void Arbiter::step(TimePoint now) {
    check_active(now);
    expire(now);
    if (!active_ && !idle_heard_.empty() && now >= quiet_since_ + settings_.end_of_frame)
        judge_idle(now);
    while (up_ && !active_ && start_next(now)) check_active(now);
}

/// Starts what is next when the line may be used. False when nothing can be done now.
bool Arbiter::start_next(TimePoint now) {
    if (now < quiet_until_ || now < quiet_since_ + gap_of(last_station_)) return false;
    const bool alone = settings_.quarantine != Quarantine::station && !retries_.empty();
    if (alone) return start_retry(now);
    if (!other_first_ && start_retry(now)) return true;
    const auto due = next_probe();
    // A probe is of the lowest class, but a busy line must not keep a station dead: its budget
    // bounds what it takes.
    constexpr Duration kPatience = 20ms;
    if (due && now >= *due + kPatience && start_probe(now)) return true;
    if (start_job(now)) return true;
    if (start_retry(now)) return true;
    return due && now >= *due && start_probe(now);
}

bool Arbiter::start_retry(TimePoint now) {
    const auto next = std::ranges::find_if(
        retries_, [&](const Group& group) { return repeat_from(group) <= now; });
    if (next == retries_.end() || !gap_is_over(now, next->station)) return false;
    Group group = std::move(*next);
    retries_.erase(next);
    start(now, std::move(group));
    return true;
}

/// At once when the reply that its station owes is to this very request, else behind that (P1).
TimePoint Arbiter::repeat_from(const Group& group) const {
    const Station& station = stations_.at(group.station);
    const bool same = station.owed == 0 || station.unanswered == group.pdu;
    return same ? TimePoint{} : station.not_before;
}

void Arbiter::forget_empty_retries() {
    std::erase_if(retries_, [](const Group& group) { return group.jobs.empty(); });
}

bool Arbiter::start_job(TimePoint now) {
    const auto runnable = [&](const Job& job) { return may_run(now, job); };
    const Job* next = queue_.peek(now, runnable);
    if (next == nullptr || !gap_is_over(now, next->station)) return false;
    other_first_ = false;
    if (next->station != kBroadcast && echo_memory_.must_be_learned_before(next->pdu)) {
        start_learning(now, *next);
    } else {
        start(now, gather(*queue_.pop(now, runnable)));
    }
    return true;
}

/// P8: nobody knows yet whether this line hears itself, and what is next could be confirmed by its
/// own echo. A read of the same station tells.
void Arbiter::start_learning(TimePoint now, const Job& job) {
    Group group;
    group.station = job.station;
    group.pdu = probe_for(station_of(job.station));
    group.learns_for = job.ticket;
    if (!teaches_echo(group.pdu))
        group.pdu = modbus::encode_read(modbus::Table::holding_registers, 0, 1);
    group.span = read_span(job.station, group.pdu);
    start(now, std::move(group));
}

bool Arbiter::start_probe(TimePoint now) {
    if (now < quarantined_until_) return false;
    const std::uint8_t station = next_to_probe(now);
    if (station == kBroadcast || !gap_is_over(now, station)) return false;
    Group group;
    group.station = station;
    group.pdu = probe_for(station_of(station));
    group.span = read_span(station, group.pdu);
    group.probe = true;
    start(now, std::move(group));
    return true;
}

/// Not while a late reply could be taken for the answer (P1).
bool Arbiter::may_run(TimePoint now, const Job& job) const {
    if (now < quarantined_until_) return false;
    const auto station = stations_.find(job.station);
    return station == stations_.end() || now >= station->second.not_before;
}

/// The longer of the silences that the last station and this one ask for.
bool Arbiter::gap_is_over(TimePoint now, std::uint8_t station) {
    const TimePoint allowed = quiet_since_ + std::max(gap_of(last_station_), gap_of(station));
    if (now >= allowed) return true;
    quiet_until_ = allowed;
    return false;
}

/// Takes along what the same transaction can answer (P6): contained reads always, touching ones as
/// long as the panel's limit allows. One request saves a request, a reply header and two gaps, so
/// joining reads without a hole is always cheaper on the wire.
Arbiter::Group Arbiter::gather(Job leader) {
    Group group;
    group.station = leader.station;
    group.pdu = leader.pdu;
    if (settings_.share_reads && !leader.alone) group.span = read_span(leader.station, leader.pdu);
    group.jobs.push_back(std::move(leader));
    while (group.span) {
        auto job = queue_.take_first([&](const Job& other) { return joins(group, other); });
        if (!job) break;
        group.span = join(*group.span, *read_span(job->station, job->pdu));
        group.jobs.push_back(std::move(*job));
    }
    if (group.jobs.size() > 1) group.pdu = encode_span(*group.span);
    return group;
}

bool Arbiter::joins(const Group& group, const Job& job) const {
    if (job.alone || job.station != group.station) return false;
    const auto span = read_span(job.station, job.pdu);
    if (!span || !group.span->touches(*span)) return false;
    if (group.span->contains(*span)) return true;
    const ReadSpan both = join(*group.span, *span);
    const StationSettings& station = settings_of(job.station);
    if (both.count > (both.reads_bits() ? station.max_bits : station.max_registers)) return false;
    return std::none_of(refused_spans_.begin(), refused_spans_.end(),
                        [&](const ReadSpan& refused) { return both.contains(refused); });
}

void Arbiter::start(TimePoint now, Group group) {
    const Bytes held = echo_.release();
    idle_heard_.insert(idle_heard_.end(), held.begin(), held.end());
    judge_idle(now);
    Bytes adu = modbus::encode_adu(group.station, group.pdu);
    if (++group.attempts > 1) ++counters_of(group.station).retries;
    if (group.attempts == 1) group.started = now;
    for (Job& job : group.jobs) {
        const auto rank = static_cast<std::size_t>(job.priority);
        if (job.attempts++ == 0) line_counters_.queue_wait[rank].observe(now - job.arrived);
    }
    const TimePoint sent = now + lead_ + wire_time(settings_.serial, adu.size());
    Duration wait{};
    std::string_view what = "broadcast";
    if (group.station == kBroadcast) {
        ++line_counters_.broadcasts;
    } else {
        Station& station = station_of(group.station);
        if (now >= station.not_before) station.owed = 0;  // its late window has passed
        if (group.span) station.last_read = group.pdu;
        wait = patience(group, station) + latency_;
        what = group.probe ? "probe" : group.attempts > 1 ? "retry" : "request";
    }
    if (group.learns_for != 0) what = "learn echo";
    if (!modbus::is_pure_read(group.pdu)) cache_.on_write(group.station, group.pdu);
    const TimePoint longest = sent + wait +
                              2 * wire_time(settings_.serial, modbus::kMaxLongRtuAdu) +
                              settings_.end_of_frame;
    echo_ = EchoFilter(adu, echo_memory_.expect(group.pdu));
    actions_.push_back(Note{now, Note::Direction::sent, adu, what, why(now, group)});
    actions_.push_back(Transmit{std::move(adu)});
    modbus::ReplyFramer framer(group.station, group.pdu);
    const Duration pause = now - quiet_since_;
    quiet_since_ = sent;
    last_station_ = group.station;
    active_.emplace(Active{std::move(group),
                           std::move(framer),
                           now,
                           sent,
                           sent + wait,
                           longest,
                           sent,
                           sent,
                           false,
                           sent,
                           !confirm_ends_,
                           true,
                           {},
                           pause});
}

/// How long to wait for a reply to begin. A probe waits only for what this line's panels have
/// needed so far, so that it costs next to nothing; should the answer come later, the late frame
/// brings the station back just as well. Every eighth one waits the whole timeout, for a station
/// that has become slow on a line where a late frame would collide.
Duration Arbiter::patience(const Group& group, Station& station) const {
    constexpr int kOneInFull = 8;
    const Duration whole = station.timeout();
    if (!group.probe || ++station.probes % kOneInFull == 0) return whole;
    const bool own = station.health.last_success().has_value();
    if (!own && !slowest_) return whole;
    const Duration slowest = own ? station.slowest : *slowest_;
    return std::min(whole, std::max<Duration>(20ms, 3 * slowest + 10ms));
}

Bytes Arbiter::probe_for(const Station& station) const {
    if (!station.probe.empty()) return station.probe;
    if (!station.last_read.empty()) return station.last_read;
    return modbus::encode_read(modbus::Table::holding_registers, 0, 1);
}

/// The offline station whose probe is due longest, kBroadcast when none is.
std::uint8_t Arbiter::next_to_probe(TimePoint now) const {
    std::uint8_t best = kBroadcast;
    TimePoint earliest = TimePoint::max();
    for (const auto& [id, station] : stations_) {
        const TimePoint due = std::max(station.health.next_probe(), station.not_before);
        if (station.health.offline() && due <= now && due < earliest) {
            earliest = due;
            best = id;
        }
    }
    return best;
}

std::optional<TimePoint> Arbiter::next_probe() const {
    std::optional<TimePoint> next;
    for (const auto& [id, station] : stations_) {
        if (!station.health.offline()) continue;
        const TimePoint due =
            std::max({station.health.next_probe(), station.not_before, budget_.next()});
        if (!next || due < *next) next = due;
    }
    return next;
}

void Arbiter::expire(TimePoint now) {
    // A broadcast that is leaving is answered when it has left.
    if (active_ && active_->group.station != kBroadcast) expire_jobs(now, active_->group.jobs);
    for (Group& group : retries_) expire_jobs(now, group.jobs);
    forget_empty_retries();
    const auto first = queue_.first_expiry();
    if (!first || now < *first) return;
    for (const Job& job : queue_.remove_if([&](const Job& j) { return j.start_by <= now; })) {
        const Fault fault = job.attempts > 0 ? Fault::timeout : Fault::expired;
        explain_end(now, job, fault);
        finish(job, fault);
    }
}

/// Those of a transaction whose own deadline has come; the others go on waiting for its reply.
void Arbiter::expire_jobs(TimePoint now, std::vector<Job>& jobs) {
    for (const Job& job : jobs) {
        if (job.deadline <= now) finish(job, Fault::timeout);
    }
    std::erase_if(jobs, [&](const Job& job) { return job.deadline <= now; });
}

std::optional<TimePoint> Arbiter::next_start() const {
    const TimePoint free = std::max(quiet_until_, quiet_since_ + gap_of(last_station_));
    std::optional<TimePoint> next;
    const auto earlier = [&](TimePoint t) {
        next = next ? std::min(*next, std::max(free, t)) : std::max(free, t);
    };
    for (const Group& group : retries_) earlier(repeat_from(group));
    queue_.each_first([&](const Job& job) {
        const auto station = stations_.find(job.station);
        const TimePoint rested = station == stations_.end() ? free : station->second.not_before;
        earlier(std::max(quarantined_until_, rested));
    });
    if (const auto probe = next_probe()) earlier(std::max(quarantined_until_, *probe));
    return next;
}

std::optional<TimePoint> Arbiter::next_deadline() const {
    std::optional<TimePoint> next = queue_.first_expiry();
    const auto earlier = [&next](TimePoint t) { next = next ? std::min(*next, t) : t; };
    const auto deadlines = [&](const Group& group) {
        for (const Job& job : group.jobs) earlier(job.deadline);
    };
    for (const Group& group : retries_) deadlines(group);
    if (active_) {
        earlier(active_deadline());
        if (!active_->end_confirmed) earlier(active_->sent);
        if (active_->group.station != kBroadcast) deadlines(active_->group);
        return next;
    }
    if (!idle_heard_.empty()) earlier(quiet_since_ + settings_.end_of_frame);
    if (!up_) return next;
    if (const auto start = next_start()) earlier(*start);
    return next;
}

}  // namespace panelgate::arbiter
