#include "panelgate/arbiter/schedule.hpp"
#include "panelgate/arbiter/book/timing.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "panelgate/modbus/function.hpp"

namespace panelgate::arbiter {

namespace {

/// Items of one read that this station is known to answer.
std::uint32_t known_length(const Station& station, const modbus::Span& span) {
    const StationSettings& settings = station.settings();
    const std::uint32_t limit =
        modbus::is_bit_table(span.table) ? settings.max_bits : settings.max_registers;
    return settings.vouched ? limit
                            : std::min(limit, station.replies().reads().longest(span.table));
}

void append(Jobs& jobs, Jobs more) {
    jobs.insert(jobs.end(), std::move_iterator(more.begin()), std::move_iterator(more.end()));
}

}  // namespace

Group Sharing::gather(Job leader, const Station& station, const OutstandingRequests& book,
                      JobQueue& queue) const {
    Group group{.station = leader.station, .request = leader.request};
    if (share_ && !leader.alone) group.span = leader.request.span();
    group.jobs.push_back(std::move(leader));
    if (!group.span) return group;
    append(group.jobs, queue.take_reads(group.station, [&](const Job& other) {
        if (!joins(group, other, station, book)) return false;
        group.span = join(*group.span, *other.request.span());
        return true;
    }));
    if (group.span != group.request.span()) group.request = modbus::Request::read(*group.span);
    return group;
}

bool Sharing::joins(const Group& group, const Job& job, const Station& station,
                    const OutstandingRequests& book) const {
    const auto& span = job.request.span();
    if (!group.span->touches(*span)) return false;
    if (group.span->contains(*span)) return true;
    const modbus::Span both = join(*group.span, *span);
    if (book.any(job.station) && book.is_ambiguous(job.station, modbus::Request::read(both)))
        return false;
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
    const auto theirs = [&](const Job& job) {
        return job.client == client && job.station == station;
    };
    return queue_.has(client, station) || std::ranges::any_of(retries_, [&](const Group& group) {
               return std::ranges::any_of(group.jobs, theirs);
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

namespace {

/// Makes a read that no client asked for.
Group internal_read(std::uint8_t station, modbus::Request request) {
    const std::optional<modbus::Span> span = request.span();
    return {.station = station, .request = std::move(request), .span = span};
}

/// P8: it is unknown whether this line has an echo, and this job could be confirmed by its own
/// echo. A read of the same station decides.
Group learning_for(const Job& job, const Station& station) {
    modbus::Request probe = station.replies().reads().probe();
    if (!teaches_echo(probe))
        probe = modbus::Request::read({modbus::Table::holding_registers, 0, 1});
    Group group = internal_read(job.station, std::move(probe));
    group.learns_for = job.ticket;
    return group;
}

}  // namespace

Schedule::Schedule(const Settings& settings)
    : quarantine_(settings.quarantine),
      may_stall_(settings.may_stall),
      backlog_(settings.queue),
      sharing_(settings.share_reads) {}

void Schedule::apply(const Settings& settings) {
    quarantine_ = settings.quarantine;
    may_stall_ = settings.may_stall;
    backlog_.queue().apply(settings.queue);
    sharing_.apply(settings.share_reads);
}

/// Time from which a job may have its turn: it is sent, or, where that is sooner, a read whose
/// answer proves that nothing else is outstanding (P1). No answer to a broadcast can then be taken
/// for its reply either (P8). A broadcast itself has no reply.
TimePoint Schedule::ready_at(const Stations& stations, const Job& job) const {
    if (job.station == kBroadcast) return {};
    const Station* station = stations.find(job.station);
    if (station == nullptr) return stations.broadcasts_over(job.station, job.request);
    // A write that its echo could confirm is preceded by a read, which may be any.
    const bool is_learned = echo_known_ || job.request.is_read();
    const OutstandingRequests& book = stations.book();
    const ReplyHabits& replies = station->replies();
    TimePoint clear = is_learned ? replies.clear_at(book, job.request) : replies.rested();
    if (can_prove(book, *station))
        clear = std::min(clear, replies.clear_at(book, replies.proof(book)));
    return std::max({clear, stations.broadcasts_over(job.station, job.request),
                     stations.throttled_until(job.station)});
}

/// At once if the outstanding reply is to this very request, else after it (P1).
TimePoint Schedule::repeat_from(const Group& group, const Stations& stations) const {
    const Station& station = *stations.find(group.station);
    return std::max(station.replies().clear_at(stations.book(), group.request, true),
                    stations.broadcasts_over(group.station, group.request));
}

/// On a connection that may delay outstanding requests, more is sent only while the station is seen
/// to answer.
bool Schedule::can_prove(const OutstandingRequests& book, const Station& station) const {
    return station.may_prove(book) && (!may_stall_ || station.is_answering());
}

Schedule::Next Schedule::next(TimePoint now, Stations& stations, Quiet& quiet,
                              const EchoMemory& echo) {
    const Line line{now, stations, quiet, echo};
    echo_known_ = echo.known();
    if (now < quiet.free_at(stations.gap(quiet.station()))) return {};
    const bool alone = backlog_.has_retries() &&
                       (quarantine_ == Quarantine::line || now < quiet.quarantined_until());
    if (alone || !others_go_first(line)) {
        if (auto group = next_retry(line)) return {std::move(group), false};
        if (alone) return {};
    }
    const auto due = stations.next_probe();
    // Probes have the lowest class, but a busy line must not keep a station offline: its budget
    // limits them.
    if (due && now >= *due + timing::kProbeWaits) {
        if (auto group = next_probe(line)) return {std::move(group), false};
    }
    if (Next job = next_job(line); job.group || job.reopen) return job;
    if (auto group = next_retry(line)) return {std::move(group), false};
    if (due && now >= *due) return {next_probe(line), false};
    return {};
}

/// The longer of the gaps that the last station and this one require.
bool Schedule::gap_is_over(const Line& line, std::uint8_t station) {
    const Duration gap =
        std::max(line.stations.gap(line.quiet.station()), line.stations.gap(station));
    const TimePoint allowed = line.quiet.free_at(gap);
    if (line.now < allowed) line.quiet.rest_until(allowed);
    return line.now >= allowed;
}

std::optional<Group> Schedule::next_retry(const Line& line) {
    auto group = backlog_.take_retry([&](const Group& waiting) {
        return repeat_from(waiting, line.stations) <= line.now &&
               gap_is_over(line, waiting.station);
    });
    if (group) let_others_go_first(line.now, line.stations);
    return group;
}

/// Reserves turns for other stations before the next retry: for those that have ever answered, if
/// any of these waits.
void Schedule::let_others_go_first(TimePoint now, const Stations& stations) {
    others_.clear();
    wrote_.clear();
    turns_ = 0;
    others_since_ = now;
    if (!backlog_.has_retries() || quarantine_ == Quarantine::line) return;
    for (const bool all : {false, true}) {
        if (!others_.empty()) break;
        backlog_.queue().any_first([&](const Job& job) {
            const bool may_answer = all || stations.condition(job.station) != Condition::unheard;
            if (may_answer || job.station == kBroadcast) others_.insert(job.station);
            return false;
        });
    }
    turns_ = patience_ > timing::kDearRetry ? others_.size() : 1;
}

/// While a retry waits, each of the others has one turn; after a write another one for its reads
/// (P9).
bool Schedule::has_turn(const Job& job) const {
    return others_.contains(job.station) || (job.request.is_read() && wrote_.contains(job.station));
}

void Schedule::take_turn(const Job& job) {
    if (turns_ > 0) --turns_;
    if (others_.erase(job.station) > 0 && !job.request.is_read()) {
        wrote_.insert(job.station);
    } else if (job.request.is_read()) {
        wrote_.erase(job.station);
    }
}

bool Schedule::others_go_first(const Line& line) const {
    const TimePoint until = others_since_ + std::max(patience_, timing::kOthersFirst);
    if (turns_ == 0 || !backlog_.has_retries() || line.now >= until) return false;
    return backlog_.queue().any_first([&](const Job& job) {
        return has_turn(job) && may_run(line, job) && line.stations.may_spend(line.now, job);
    });
}

std::optional<Group> Schedule::next_probe(const Line& line) const {
    if (line.now < line.quiet.quarantined_until()) return std::nullopt;
    const auto station = line.stations.next_to_probe(line.now);
    if (!station || !gap_is_over(line, *station)) return std::nullopt;
    Group group = internal_read(*station, line.stations.find(*station)->replies().reads().probe());
    group.probe = true;
    return group;
}

/// Not while a late reply could be taken for the answer (P1).
bool Schedule::may_run(const Line& line, const Job& job) const {
    return line.now >= line.quiet.quarantined_until() && line.now >= ready_at(line.stations, job) &&
           !backlog_.has_retry(job.station);
}

/// P1: an outstanding reply of its station could be taken for the answer to this job. Stations
/// serve in order: the answer to a read of another length proves that none can come. If the
/// transport may delay frames and the station does not answer, the connection that the request was
/// sent on proves nothing: a new one is needed.
std::optional<Schedule::Next> Schedule::proof_before(const Line& line, const Job& job) const {
    const Station* station = line.stations.find(job.station);
    if (station == nullptr) return std::nullopt;
    const OutstandingRequests& book = line.stations.book();
    const ReplyHabits& replies = station->replies();
    if (!book.is_ambiguous(job.station, job.request)) return std::nullopt;
    const bool is_in_transit = in_transit(line.stations, *station);
    if (!is_in_transit && line.now >= replies.clear_at(book, job.request)) return std::nullopt;
    if (is_in_transit && !can_prove(book, *station) && book.any_since(job.station, book.opened()))
        return Next{std::nullopt, true};
    Group proof = internal_read(job.station, replies.proof(book));
    proof.probe = true;
    proof.distinct_length = proof.request != replies.reads().probe();
    return Next{std::move(proof), false};
}

/// A read that no client asked for and that goes before this job: a proof (P1), or one that shows
/// whether the line has an echo (P8).
std::optional<Schedule::Next> Schedule::read_before(const Line& line, const Job& job) {
    if (job.station == kBroadcast) return std::nullopt;
    if (auto proof = proof_before(line, job)) return proof;
    if (!line.echo.must_be_learned_before(job.request, job.ticket == learned_for_))
        return std::nullopt;
    learned_for_ = job.ticket;
    return Next{learning_for(job, line.stations.of(job.station)), false};
}

/// P9: in the turn of a station's write its read goes first, and the write is next; now and then
/// its poll goes before its read.
JobQueue::Choice Schedule::own_turn(const Line& line, JobQueue::Choice next,
                                    const JobQueue::Test& may_run) const {
    const Station* const station = line.stations.find(next.job()->station);
    if (station == nullptr) return next;
    const auto prefer = [&](bool (*is)(const Job&)) {
        const auto own = backlog_.queue().choose([&, is](const Job& job) {
            return job.station == station->id() && is(job) && may_run(job);
        });
        if (own.job() != nullptr) next = own;
    };
    if (!next.job()->request.is_read() && station->has_read_turn())
        prefer([](const Job& job) { return job.request.is_read(); });
    if (next.job()->priority == PriorityClass::read && station->has_poll_turn())
        prefer([](const Job& job) { return job.priority == PriorityClass::poll; });
    return next;
}

Schedule::Next Schedule::next_job(const Line& line) {
    struct {
        bool others;
        bool in_budget = true;
    } wanted{others_go_first(line)};
    const Station* const last = line.stations.find(line.quiet.station());
    const bool is_dear = last != nullptr && last->usual() > timing::kDearRetry;
    const JobQueue::Test test = [&](const Job& job) {
        const bool lets_others = is_dear && job.station == last->id();
        return (!wanted.others || has_turn(job)) && may_run(line, job) &&
               (!wanted.in_budget || (!lets_others && line.stations.may_spend(line.now, job)));
    };
    const JobQueue& queue = backlog_.queue();
    JobQueue::Choice next = queue.choose(test);
    // One that fails or needs long waits, for its share or a turn, only while others want the line.
    wanted.in_budget = next.job() != nullptr;
    if (next.job() == nullptr) next = queue.choose(test);
    if (next.job() == nullptr) return {};
    next = own_turn(line, next, test);
    if (!gap_is_over(line, next.job()->station)) return {};
    if (auto read = read_before(line, *next.job())) return std::move(*read);
    Job job = backlog_.queue().take(next);
    take_turn(job);
    if (job.station == kBroadcast) {
        Group group{.request = job.request};
        group.jobs.push_back(std::move(job));
        return {std::move(group), false};
    }
    const OutstandingRequests& book = line.stations.book();
    const Station& asked = line.stations.of(job.station);
    return {sharing_.gather(std::move(job), asked, book, backlog_.queue()), false};
}

std::optional<TimePoint> Schedule::next_start(const Stations& stations, const Quiet& quiet) const {
    const TimePoint free = quiet.free_at(stations.gap(quiet.station()));
    std::optional<TimePoint> next;
    const auto earlier = [&](TimePoint t) {
        next = next ? std::min(*next, std::max(free, t)) : std::max(free, t);
    };
    for (const Group& group : backlog_.retries()) earlier(repeat_from(group, stations));
    // Usually the first may start at once: then nothing can start sooner.
    const bool at_once = backlog_.queue().any_first([&](const Job& job) {
        if (backlog_.has_retry(job.station)) return false;
        earlier(std::max(quiet.quarantined_until(), ready_at(stations, job)));
        return *next <= free;
    });
    if (at_once) return next;
    if (const auto probe = stations.next_probe())
        earlier(std::max(quiet.quarantined_until(), *probe));
    return next;
}

std::optional<TimePoint> Schedule::line_rests_until(TimePoint now, const Group& failed,
                                                    TimePoint sent, const Station& station) const {
    const StationSettings& own = station.settings();
    const TimePoint rested = station.replies().rested();
    if (quarantine_ == Quarantine::line && !failed.probe) {
        return own.adaptive_timeout ? std::min(rested, now + station.response_timeout()) : rested;
    }
    // A rest longer than another timeout is not worth it: a collision costs that much.
    const Duration worst = station.replies().worst_lateness();
    const bool is_late =
        failed.first_silence && worst > Duration::zero() && worst <= own.response_timeout;
    if (quarantine_ != Quarantine::automatic || !is_late) return std::nullopt;
    return std::min(rested, sent + own.response_timeout + worst * 5 / 4);
}

void Schedule::retry(TimePoint now, Group group, Duration patience, const Stations& stations) {
    const bool begins = !backlog_.has_retries() || group.attempts > group.doubts + 1;
    const bool at_once = !group.confirms.empty();
    if (!backlog_.has_retries()) patience_ = {};
    // A retried write has had its turn among the writes.
    if (group.request.is_read()) patience_ += patience;
    backlog_.retry(std::move(group));
    if (begins) let_others_go_first(now, stations);
    if (at_once) turns_ = 0;
}

Jobs Schedule::give_back(Group& group) {
    for (Job& job : sharing_.split(group)) backlog_.queue().put_back(std::move(job));
    return take_if(group.jobs, [](const Job& job) { return job.gone; });
}

}  // namespace panelgate::arbiter
