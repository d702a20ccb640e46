#include "panelgate/arbiter/schedule.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "panelgate/arbiter/timing.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::arbiter {

namespace {

/// Items of one read that this station is known to answer.
std::uint32_t known_length(const Station& station, const modbus::Span& span) {
    const StationSettings& settings = station.settings();
    const std::uint32_t limit =
        modbus::is_bit_table(span.table) ? settings.max_bits : settings.max_registers;
    return settings.vouched ? limit : std::min(limit, station.reads().longest(span.table));
}

void append(Jobs& jobs, Jobs more) {
    jobs.insert(jobs.end(), std::move_iterator(more.begin()), std::move_iterator(more.end()));
}

/// Makes a read of the gateway's own: the reply shows that the station is there.
Group internal_read(const Station& station, const modbus::Request& read) {
    const bool any_length = station.settings().any_length;
    return {.station = station.id(), .request = any_length ? read.with_any_length() : read};
}

}  // namespace

Reason reason_of(TimePoint now, const Group& group, const JobQueue& queue) {
    if (group.probe) return {.kind = Reason::Kind::probe};
    if (group.learns_for != 0) return {.kind = Reason::Kind::learns_echo};
    const Job& leader = group.jobs.front();
    return {.kind = group.attempts > 1 ? Reason::Kind::again : Reason::Kind::turn,
            .priority = leader.priority,
            .station = leader.station,
            .asked_function = leader.asked_function,
            .passed_over = queue.last_was_passed_over(),
            .attempt = group.attempts,
            .answers = static_cast<std::uint32_t>(group.jobs.size()),
            .waited = now - leader.arrived,
            .waiting = queue.waiting(),
            .client = leader.client};
}

Group Sharing::gather(TimePoint now, Job leader, const Station& station,
                      const Outstanding& outstanding, JobQueue& queue) const {
    Group group{.station = leader.station, .request = leader.request};
    if (share_ && !leader.alone) group.span = leader.request.span();
    group.jobs.push_back(std::move(leader));
    if (!group.span || outstanding.any(now, group.station)) return group;
    append(group.jobs, queue.take_reads(group.station, [&](const Job& other) {
        if (!joins(group, other, station)) return false;
        group.span = join(*group.span, *other.request.span());
        return true;
    }));
    if (group.span != group.request.span()) group.request = modbus::Request::read(*group.span);
    return group;
}

bool Sharing::joins(const Group& group, const Job& job, const Station& station) const {
    const auto& span = job.request.span();
    if (!group.span->touches(*span)) return false;
    if (group.span->contains(*span)) return true;
    const modbus::Span both = join(*group.span, *span);
    // A span that contains all the others was asked for by a client itself.
    if (both != *span && both.count > known_length(station, both)) return false;
    return std::none_of(refused_.begin(), refused_.end(), [&](const ReadSpan& refused) {
        return ReadSpan{job.station, both}.contains(refused);
    });
}

Jobs Sharing::split(Group& group) {
    const auto stays = [&](const Job& job) { return job.request == group.request || job.gone; };
    if (group.joined()) {
        if (refused_.size() >= kRemembered) refused_.pop_front();
        refused_.push_back({group.station, *group.span});
    }
    Jobs parts;
    for (auto job = group.jobs.rbegin(); job != group.jobs.rend(); ++job) {
        if (stays(*job)) continue;
        job->alone = true;
        parts.push_back(*job);
    }
    std::erase_if(group.jobs, [&](const Job& job) { return !stays(job); });
    return parts;
}

Bytes Sharing::part_for(const Group& group, const Bytes& reply, const Job& job) {
    if (job.request == group.request || modbus::exception_of(reply)) return reply;
    return slice_reply(*group.span, reply, *job.request.span());
}

bool Backlog::has(Client client, std::uint8_t station) const {
    return queue_.has(client, station) || std::ranges::any_of(retries_, [&](const Group& group) {
               return group.station == station && group.has(client, station);
           });
}

std::optional<Group> Backlog::take_retry(const InlineFunction<bool(const Group&), 48>& may_go) {
    const auto next = std::ranges::find_if(retries_, may_go);
    if (next == retries_.end()) return std::nullopt;
    Group group = std::move(*next);
    retries_.erase(next);
    return group;
}

Jobs Backlog::remove_retries(const JobQueue::Test& match) {
    Jobs removed;
    if (retries_.empty()) return removed;
    for (Group& group : retries_) {
        append(removed, take_if(group.jobs, match));
        if (!group.abandoned()) continue;
        append(removed, std::exchange(group.jobs, {}));  // they left while it was on the wire
        dropped_.push_back(std::move(group));
    }
    std::erase_if(retries_, [](const Group& group) { return group.abandoned(); });
    return removed;
}

Jobs Backlog::cancel(Client client) {
    const auto theirs = [&](const Job& job) { return job.client == client; };
    Jobs removed = queue_.remove_if(theirs);
    append(removed, remove_retries(theirs));
    return removed;
}

Jobs Backlog::expire(TimePoint now) {
    Jobs removed = remove_retries([&](const Job& job) { return job.deadline <= now; });
    const auto first = queue_.first_expiry();
    if (!first || now < *first) return removed;
    append(removed, queue_.remove_if([&](const Job& job) { return job.start_by <= now; }));
    return removed;
}

std::optional<TimePoint> Backlog::first_expiry() const {
    std::optional<TimePoint> first = queue_.first_expiry();
    for (const Group& group : retries_) {
        for (const Job& job : group.jobs) {
            if (!first || job.deadline < *first) first = job.deadline;
        }
    }
    return first;
}

Jobs Backlog::clear() {
    const auto all = [](const Job&) { return true; };
    Jobs removed = remove_retries(all);
    append(removed, queue_.remove_if(all));
    dropped_.clear();
    return removed;
}

Schedule::Schedule(const Settings& settings)
    : quarantine_(settings.quarantine), backlog_(settings.queue), sharing_(settings.share_reads) {}

void Schedule::apply(const Settings& settings) {
    quarantine_ = settings.quarantine;
    backlog_.queue().apply(settings.queue);
    sharing_.apply(settings.share_reads);
}

/// Time from which this request, or the read that goes before it, may be sent: no outstanding reply
/// can then be taken for its reply (T2, T8, T11). `may_learn`: a read goes first to show the echo.
TimePoint Schedule::clear_at(TimePoint now, const Stations& stations, const Station& station,
                             const modbus::Request& request, bool may_learn) {
    const Outstanding& outstanding = stations.outstanding();
    const std::uint8_t id = station.id();
    TimePoint clear = outstanding.clear_at(now, id, request);
    TimePoint earlier = outstanding.clear_at(now, id, request, false, true);
    if (may_learn) {
        const modbus::Request probe = station.reads().probe();
        clear = std::max(clear, outstanding.clear_at(now, id, probe));
        earlier = std::max(earlier, outstanding.clear_at(now, id, probe, false, true));
    }
    constexpr int kAnswers = 2;  // silent transactions in a row: more, and a proof is no quicker
    if (clear <= now || station.health().offline() ||
        station.health().silent_in_a_row() >= kAnswers)
        return clear;
    return stations.proof_for(now, station) ? earlier : clear;
}

/// Time from which a job may have its turn. A broadcast has no reply.
TimePoint Schedule::ready_at(TimePoint now, const Stations& stations, const Job& job) const {
    if (job.station == kBroadcast) return {};
    const TimePoint held = stations.held_until(now, job);
    const Station* const station = stations.find(job.station);
    if (station == nullptr) return held;
    const bool may_learn = !echo_known_ && !job.request.is_read();
    const TimePoint clear = clear_at(now, stations, *station, job.request, may_learn);
    // What may be held back on its way is asked for again.
    const bool in_transit = clear == Outstanding::kInTransit;
    const Asked* const last =
        in_transit ? stations.outstanding().last_read(now, job.station) : nullptr;
    const TimePoint told = last == nullptr ? TimePoint{} : last->sent + station->latest_reply();
    return std::max({in_transit ? told : clear, station->rests_until(), held});
}

TimePoint Schedule::repeat_from(TimePoint now, const Group& group, const Stations& stations) {
    const Station& station = *stations.find(group.station);
    return std::max(stations.outstanding().clear_at(now, group.station, group.request, true),
                    station.rests_until());
}

std::optional<Group> Schedule::next(TimePoint now, Stations& stations, Quiet& quiet,
                                    const EchoMemory& echo, const MayStart& may_start) {
    const Line line{now, stations, quiet, echo, may_start};
    echo_known_ = echo.state() != EchoState::unknown;
    if (now < quiet.free_at(stations.gap(quiet.station()))) return {};
    const bool alone = !backlog_.retries().empty() &&
                       (quarantine_ == Quarantine::line || now < quiet.quarantined_until());
    if (!alone && others_go_first(line)) return next_job(line, true);
    if (auto group = next_retry(line)) return group;
    if (alone) return {};
    const auto due = stations.next_probe(now);
    // A busy line must not keep a station offline: the budget limits probes.
    if (due && now >= *due + timing::kProbeWaits) {
        if (auto group = next_probe(line)) return group;
    }
    if (auto group = next_job(line, false)) return group;
    if (auto group = next_retry(line)) return group;
    if (due && now >= *due) return next_probe(line);
    return {};
}

/// The line needs the longer gap of the last station and of this station.
bool Schedule::gap_is_over(const Line& line, std::uint8_t station) {
    const Duration gap =
        std::max(line.stations.gap(line.quiet.station()), line.stations.gap(station));
    const TimePoint allowed = line.quiet.free_at(gap);
    if (line.now < allowed) line.quiet.rest_until(allowed);
    return line.now >= allowed;
}

std::optional<Group> Schedule::next_retry(const Line& line) {
    return backlog_.take_retry([&](const Group& waiting) {
        return repeat_from(line.now, waiting, line.stations) <= line.now &&
               line.takes(waiting.station, waiting.request.is_read()) &&
               gap_is_over(line, waiting.station);
    });
}

/// Behind a silence those who wait go first, for what comes next may cost them as much again (P4).
/// Not where frames get lost on this line: who is asked again waits, too.
bool Schedule::others_go_first(const Line& line) const {
    const Duration most = line.stations.response_timeout(line.quiet.station()) / 2;
    if (line.now >= silent_ + most || line.stations.loses_frames(line.now)) return false;
    return backlog_.queue().any_first([&](const Job& job) { return goes_first(line, job); });
}

bool Schedule::goes_first(const Line& line, const Job& job) const {
    const Station* const station = line.stations.find(job.station);
    return job.arrived <= silent_ && station != nullptr && station->health().last_heard() &&
           station->answers_now(job.request.is_read()) && may_run(line, job) &&
           line.stations.may_spend(line.now, job);
}

std::optional<Group> Schedule::next_probe(const Line& line) const {
    if (line.now < line.quiet.quarantined_until()) return std::nullopt;
    const auto station = line.stations.next_to_probe(line.now);
    if (!station || !line.takes(*station, true) || !gap_is_over(line, *station))
        return std::nullopt;
    const Station& asked = *line.stations.find(*station);
    Group group = internal_read(asked, line.stations.probe_for(line.now, asked));
    group.probe = true;
    return group;
}

bool Schedule::may_run(const Line& line, const Job& job) const {
    return line.now >= line.quiet.quarantined_until() &&
           line.takes(job.station, job.request.is_read()) &&
           line.now >= ready_at(line.now, line.stations, job) && !backlog_.has_retry(job.station);
}

/// A read that no client asked for and that goes before this job: a proof (T2), or a read that
/// shows whether the line has an echo (T6).
std::optional<Group> Schedule::read_before(const Line& line, const Job& job) {
    const Station* const station = line.stations.find(job.station);
    if (job.station == kBroadcast || station == nullptr) return std::nullopt;
    const Outstanding& outstanding = line.stations.outstanding();
    const bool learns = job.ticket != learned_for_ && line.echo.must_be_learned_before(job.request);
    modbus::Request probe = station->reads().probe();
    TimePoint clear = outstanding.clear_at(line.now, job.station, job.request);
    if (learns) clear = std::max(clear, outstanding.clear_at(line.now, job.station, probe));
    if (clear > line.now) {
        Group proof = internal_read(*station, line.stations.probe_for(line.now, *station));
        proof.probe = true;
        return proof;
    }
    if (!learns) return std::nullopt;
    learned_for_ = job.ticket;
    if (!teaches_echo(probe))
        probe = modbus::Request::read({modbus::Table::holding_registers, 0, 1});
    Group group = internal_read(*station, probe);
    group.learns_for = job.ticket;
    return group;
}

/// `behind_silence`: of those who go first.
std::optional<Group> Schedule::next_job(const Line& line, bool behind_silence) {
    bool in_budget = true;
    const JobQueue::Test test = [&](const Job& job) {
        if (behind_silence) return goes_first(line, job);
        return may_run(line, job) && (!in_budget || line.stations.may_spend(line.now, job));
    };
    const JobQueue& queue = backlog_.queue();
    JobQueue::Choice next = queue.choose(test);
    // A suspect waits for its share only while others want the line.
    in_budget = next.job() != nullptr;
    if (next.job() == nullptr) next = queue.choose(test);
    if (next.job() == nullptr || !gap_is_over(line, next.job()->station)) return std::nullopt;
    if (auto before = read_before(line, *next.job())) return before;
    Job job = backlog_.queue().take(next);
    if (job.station == kBroadcast) {
        Group group{.request = job.request};
        group.jobs.push_back(std::move(job));
        return group;
    }
    const Station& asked = line.stations.of(job.station);
    return sharing_.gather(line.now, std::move(job), asked, line.stations.outstanding(),
                           backlog_.queue());
}

std::optional<TimePoint> Schedule::next_start(TimePoint now, const Stations& stations,
                                              const Quiet& quiet) const {
    const TimePoint free = quiet.free_at(stations.gap(quiet.station()));
    const TimePoint quarantined = quiet.quarantined_until();
    std::optional<TimePoint> next;
    const auto earlier = [&](TimePoint t) {
        if (t == Outstanding::kInTransit) return;
        t = std::max(free, t);
        next = next ? std::min(*next, t) : t;
    };
    for (const Group& group : backlog_.retries()) earlier(repeat_from(now, group, stations));
    // Usually the first may start at once: then nothing can start sooner.
    const bool at_once = backlog_.queue().any_first([&](const Job& job) {
        if (backlog_.has_retry(job.station)) return false;
        earlier(std::max(quarantined, ready_at(now, stations, job)));
        return *next <= free;
    });
    if (at_once) return next;
    if (const auto probe = stations.next_probe(now)) earlier(std::max(quarantined, *probe));
    return next;
}

std::optional<TimePoint> Schedule::line_rests_until(TimePoint now, const Group& failed,
                                                    TimePoint sent, const Station& station) const {
    const StationSettings& own = station.settings();
    const TimePoint rested = sent + station.latest_reply();
    if (quarantine_ == Quarantine::line && !failed.probe)
        return own.adaptive_timeout ? std::min(rested, now + station.response_timeout()) : rested;
    // A rest longer than another timeout is not worth it: a collision costs that much.
    const Duration worst = station.lateness();
    const bool is_late =
        failed.was_online && worst > Duration::zero() && worst <= own.response_timeout;
    if (quarantine_ != Quarantine::automatic || !is_late) return std::nullopt;
    return std::min(rested, sent + own.response_timeout + worst * 5 / 4);
}

Jobs Schedule::give_back(Group& group) {
    for (Job& job : sharing_.split(group)) backlog_.queue().put_back(std::move(job));
    return take_if(group.jobs, [](const Job& job) { return job.gone; });
}

}  // namespace panelgate::arbiter
