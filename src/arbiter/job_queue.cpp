#include "panelgate/arbiter/job_queue.hpp"

#include <algorithm>
#include <iterator>
#include <ranges>
#include <utility>

namespace panelgate::arbiter {

namespace {

constexpr auto kWrite = static_cast<std::size_t>(PriorityClass::write);
constexpr auto kRead = static_cast<std::size_t>(PriorityClass::read);
constexpr auto kPoll = static_cast<std::size_t>(PriorityClass::poll);

void sort_by_ticket(Jobs& jobs) { std::ranges::sort(jobs, {}, &Job::ticket); }

}  // namespace

std::size_t JobQueue::rank_of(const Job& job) {
    return std::min(static_cast<std::size_t>(job.priority), kPoll);
}

template <class Visit>
bool JobQueue::any_lane(const Visit& visit) const {
    for (const auto& [host, origin] : hosts_) {
        for (const auto& [client, source] : origin.sources) {
            for (const auto& [station, lane] : source.lanes)
                if (visit(Found{{host, client, station}, origin, source, lane})) return true;
        }
    }
    return false;
}

const JobQueue::Source* JobQueue::find(Client client) const {
    const auto home = home_.find(client);
    return home == home_.end() ? nullptr : &hosts_.at(home->second).sources.at(client);
}

/// Lanes are in order of tickets, so their first jobs decide; broadcasts are the first lane.
const Job* JobQueue::Source::first(std::uint8_t station) const {
    const auto lane = lanes.find(station);
    if (lane == lanes.end()) return nullptr;
    const Job* const job = &lane->second.jobs.front().job;
    const auto is_before = [job](const Lane& other) {
        return job->ticket <= other.jobs.front().job.ticket;
    };
    const auto& [lowest, broadcasts] = *lanes.begin();
    if (lowest != kBroadcast) return job;
    if (station != kBroadcast) return is_before(broadcasts) ? job : nullptr;
    return std::ranges::all_of(lanes | std::views::values, is_before) ? job : nullptr;
}

/// False if a host with an earlier turn was found in each class that waits.
bool JobQueue::may_be_next(const Origin& origin, const Choice& choice) const {
    for (std::size_t rank = 0; rank < kRanks; ++rank) {
        const Choice::First& first = choice.first_[rank];
        const bool is_earlier = first.job != nullptr && first.turn[0] < origin.turns[rank];
        if (firsts_[rank] > 0 && !is_earlier) return true;
    }
    return false;
}

/// A lower class never goes ahead twice in a row, so that a write waits for only one.
JobQueue::Choice JobQueue::choose(const Test& may_run) const {
    Choice choice;
    const auto look_at = [&](const Found& at) {
        const std::size_t rank = rank_of(at.lane.jobs.front().job);
        Choice::First& first = choice.first_[rank];
        const std::array turn{at.origin.turns[rank], at.source.turns[rank], at.lane.turns[rank]};
        if (first.job != nullptr && first.turn < turn) return;
        const Job* const job = at.source.first(at.place.station);
        if (job != nullptr && may_run(*job)) first = {job, at.place, turn};
    };
    for (const auto& [host, origin] : hosts_) {
        if (!may_be_next(origin, choice)) continue;
        for (const auto& [client, source] : origin.sources) {
            for (const auto& [station, lane] : source.lanes)
                look_at({{host, client, station}, origin, source, lane});
        }
    }
    std::size_t top = 0;
    while (top < kRanks && choice.first_[top].job == nullptr) ++top;
    choice.rank_ = top;
    if (last_was_passed_over_) return choice;  // the higher class goes
    if (top < kRead && choice.first_[kRead].job != nullptr && passed_[kRead] >= kReadTurn - 1) {
        choice.rank_ = kRead;
    } else if (top < kPoll && choice.first_[kPoll].job != nullptr && is_polls_turn(choice, top)) {
        choice.rank_ = kPoll;
    }
    choice.passed_over_ = choice.rank_ != top;
    return choice;
}

/// Its last chance is the tenth turn. Where a read could then be in the way (because it is due
/// itself, or would be in the following turn, which is a write's again), the poll goes up to three
/// turns earlier; one of these four turns is always free for it.
bool JobQueue::is_polls_turn(const Choice& choice, std::size_t top) const {
    const bool read = choice.first_[kRead].job != nullptr;
    const int reads_wait = passed_[kRead];
    if (read && reads_wait >= kReadTurn - 2) return false;
    const bool in_the_way = top == kWrite && reads_wait + (read ? 1 : 0) >= kReadTurn - 2;
    return passed_[kPoll] >= kPollTurn - (in_the_way ? 4 : 1);
}

void JobQueue::count_turn(const Choice& choice) {
    last_was_passed_over_ = choice.passed_over_;
    for (const std::size_t rank : {kRead, kPoll}) {
        if (rank == choice.rank_ || firsts_[rank] == 0) {
            passed_[rank] = 0;
        } else if (choice.first_[rank].job != nullptr) {
            ++passed_[rank];
        }
    }
}

Job JobQueue::take(const Choice& choice) {
    count_turn(choice);
    const std::size_t rank = choice.rank_;
    const Place& place = choice.first_[rank].place;
    Origin& origin = hosts_.at(place.host);
    Source& source = origin.sources.at(place.client);
    Lane& lane = source.lanes.at(place.station);
    origin.turns[rank] = source.turns[rank] = lane.turns[rank] = ++turns_;
    return take(place, 0);
}

Jobs JobQueue::take_all(std::uint8_t station, const Test& wanted) {
    Jobs taken;
    for (bool again = true; again;) {
        again = false;
        PoolMap<Ticket, Place> places;
        any_lane([&](const Found& at) {
            if (at.place.station == station)
                places.emplace(at.lane.jobs.front().job.ticket, at.place);
            return false;
        });
        for (const auto& [ticket, place] : places) {
            for (const Source* source = find(place.client); source != nullptr;
                 source = find(place.client)) {
                const Job* const job = source->first(station);
                if (job == nullptr || !wanted(*job)) break;
                taken.push_back(take(place, 0));
                again = true;
            }
        }
    }
    sort_by_ticket(taken);
    return taken;
}

Jobs JobQueue::remove_if(const Test& match) {
    PoolVector<std::pair<Place, std::size_t>> found;
    any_lane([&](const Found& at) {
        for (std::size_t i = 0; i < at.lane.jobs.size(); ++i)
            if (match(at.lane.jobs[i].job)) found.emplace_back(at.place, i);
        return false;
    });
    Jobs removed;
    for (auto it = found.rbegin(); it != found.rend(); ++it)
        removed.push_back(take(it->first, it->second));
    sort_by_ticket(removed);
    return removed;
}

bool JobQueue::any_first(const Test& match) const {
    return any_lane([&](const Found& at) {
        const Job* const job = at.source.first(at.place.station);
        return job != nullptr && match(*job);
    });
}

bool JobQueue::has(Client client, std::uint8_t station) const {
    const Source* const source = find(client);
    return source != nullptr &&
           (source->lanes.contains(station) || source->lanes.contains(kBroadcast));
}

std::optional<TimePoint> JobQueue::first_expiry() const {
    if (expiries_.empty()) return std::nullopt;
    return *expiries_.begin();
}

// Lanes and accounting.

JobQueue::Entry JobQueue::entry_of(Job job) {
    std::optional<ReadSpan> span;
    const auto& items = job.request.span();
    if (items && !job.alone && job.station != 0) span = {job.station, *items};
    return {std::move(job), span};
}

/// A client keeps its host while a job of it waits.
JobQueue::HostKey JobQueue::host_of(const Job& job) const {
    const auto home = home_.find(job.client);
    if (home != home_.end()) return home->second;
    return job.host == 0 ? HostKey{true, job.client} : HostKey{false, job.host};
}

/// Who is new has the last turn in all classes.
JobQueue::Lane& JobQueue::open_lane(const Place& place) {
    const auto open = [this](auto& map, const auto& key) -> auto& {
        const auto [it, added] = map.try_emplace(key);
        if (added) it->second.turns.fill(++turns_);
        return it->second;
    };
    Origin& origin = open(hosts_, place.host);
    Source& source = open(origin.sources, place.client);
    home_.emplace(place.client, place.host);
    return open(source.lanes, place.station);
}

void JobQueue::put_back(Job job) { insert(entry_of(std::move(job))); }

/// Inserts by ticket: at the end if it is new, further ahead if it was taken before.
void JobQueue::insert(Entry entry) {
    PoolDeque<Entry>& jobs =
        open_lane({host_of(entry.job), entry.job.client, entry.job.station}).jobs;
    expiries_.insert(entry.job.start_by);
    if (entry.span) {
        reads_.add(entry.job, *entry.span, [this](Client client, int by) { count(client, by); });
    } else {
        count(entry.job.client, 1);
    }
    if (!jobs.empty()) --firsts_[rank_of(jobs.front().job)];
    auto at = jobs.end();
    while (at != jobs.begin() && std::prev(at)->job.ticket > entry.job.ticket) --at;
    jobs.insert(at, std::move(entry));
    ++firsts_[rank_of(jobs.front().job)];
}

Job JobQueue::take(const Place& place, std::size_t index) {
    Origin& origin = hosts_.at(place.host);
    Source& source = origin.sources.at(place.client);
    PoolDeque<Entry>& jobs = source.lanes.at(place.station).jobs;
    const auto at = jobs.begin() + static_cast<std::ptrdiff_t>(index);
    expiries_.erase(expiries_.find(at->job.start_by));
    if (at->span) {
        reads_.remove(at->job, *at->span, [this](Client client, int by) { count(client, by); });
    } else {
        count(place.client, -1);
    }
    --firsts_[rank_of(jobs.front().job)];
    Job job = std::move(at->job);
    jobs.erase(at);
    if (jobs.empty()) {
        source.lanes.erase(place.station);
    } else {
        ++firsts_[rank_of(jobs.front().job)];
    }
    if (source.lanes.empty()) {
        origin.sources.erase(place.client);
        home_.erase(place.client);
    }
    if (origin.sources.empty()) hosts_.erase(place.host);
    return job;
}

void JobQueue::count(Client client, int by) {
    Origin& origin = hosts_.at(home_.at(client));
    const auto change = static_cast<std::size_t>(by);  // unsigned wrap-around is intended
    origin.sources.at(client).counting += change;
    origin.counting += change;
    size_ += change;
}

bool JobQueue::source_consistent(Client client, const HostKey& host, const Source& source) const {
    std::size_t counting = 0;
    for (const auto& [station, lane] : source.lanes) {
        if (lane.jobs.empty()) return false;
        for (std::size_t i = 0; i < lane.jobs.size(); ++i) {
            const auto& [job, span] = lane.jobs[i];
            if (job.client != client || job.station != station) return false;
            if (i > 0 && lane.jobs[i - 1].job.ticket >= job.ticket) return false;
            if (!span || reads_.counts(job.ticket, *span)) ++counting;
        }
    }
    return !source.lanes.empty() && counting == source.counting && home_.at(client) == host;
}

bool JobQueue::consistent() const {
    std::size_t counting = 0;
    std::size_t waiting = 0;
    std::size_t clients = 0;
    std::array<std::size_t, kRanks> firsts{};
    for (const auto& [host, origin] : hosts_) {
        std::size_t of_host = 0;
        for (const auto& [client, source] : origin.sources) {
            if (!source_consistent(client, host, source)) return false;
            of_host += source.counting;
            ++clients;
            for (const auto& [station, lane] : source.lanes) {
                waiting += lane.jobs.size();
                ++firsts[rank_of(lane.jobs.front().job)];
            }
        }
        if (origin.sources.empty() || of_host != origin.counting) return false;
        counting += of_host;
    }
    return counting == size_ && waiting == expiries_.size() && clients == home_.size() &&
           firsts == firsts_;
}

// Admission to the queue, and dropping jobs for it.

JobQueue::PushResult JobQueue::push(Job job) {
    PushResult result;
    if (waiting() >= kMost) return result;
    Entry entry = entry_of(std::move(job));
    if (!entry.span || !reads_.carries(*entry.span)) {
        const Source* const source = find(entry.job.client);
        if (source != nullptr && source->counting >= settings_.per_client) return result;
        if (size_ >= settings_.limit && !make_room(entry.job, result.shed)) return {};
    }
    result.taken = true;
    insert(std::move(entry));
    return result;
}

/// If the victim carried other reads, these count in its place and may have to go as well. Tried on
/// a copy of the queue: either there is room in the end, or nothing changes.
bool JobQueue::make_room(const Job& newcomer, Jobs& shed) {
    const auto first = find_victim(newcomer);
    if (!first) return false;
    if (first->makes_room) {
        shed.push_back(take(first->place, first->index));
        return true;
    }
    JobQueue after = *this;
    while (after.size_ >= settings_.limit) {
        const auto victim = after.find_victim(newcomer);
        if (!victim) return false;
        shed.push_back(after.take(victim->place, victim->index));
    }
    *this = std::move(after);
    return true;
}

/// The victim of whoever is greedier than the newcomer: of a host with more waiting than its own
/// would have, else of a client of its own. The one with the most loses; among equals the newest
/// request is dropped, so that not always the same client loses.
std::optional<JobQueue::Victim> JobQueue::find_victim(const Job& newcomer) const {
    const HostKey own = host_of(newcomer);
    const auto origin = hosts_.find(own);
    const Source* const source = find(newcomer.client);
    const std::size_t of_host = origin == hosts_.end() ? 0 : origin->second.counting;
    const std::size_t of_client = source == nullptr ? 0 : source->counting;
    const bool write = newcomer.priority == PriorityClass::write;
    // Writes come first, but not at the expense of the places of reads that every fifth turn needs.
    const bool replaces_reads = write && kReadTurn * reads_.counting() > settings_.limit;
    std::optional<Victim> best;
    any_lane([&](const Found& at) {
        const bool is_own = at.place.host == own;
        const std::size_t load = is_own ? at.source.counting : at.origin.counting;
        const std::size_t mine = is_own ? of_client : of_host;
        const bool greedier = load > mine + 1;
        if (!greedier && (load < mine || !replaces_reads)) return false;
        auto victim = victim_in(at);
        const bool writes_too = greedier && (write || 2 * at.origin.counting > size_);
        if (!victim || (victim->is_write && !writes_too)) return false;
        const int level = !greedier ? 0 : is_own ? 1 : 2;
        victim->greed = {level, at.origin.counting, at.source.counting};
        if (!best || *best < *victim) best = victim;
        return false;
    });
    return best;
}

/// The newest of a lane whose removal frees a place; if there is none, because carried reads would
/// count instead, the newest that counts. Only reads remain behind it, so its removal breaks no
/// order; likewise nothing younger may wait across a broadcast.
std::optional<JobQueue::Victim> JobQueue::victim_in(const Found& at) const {
    const auto& jobs = at.lane.jobs;
    const std::uint8_t station = at.place.station;
    std::optional<Victim> found;
    for (std::size_t i = jobs.size(); i-- > 0;) {
        const auto& [job, span] = jobs[i];
        const bool frees = !span || reads_.frees(job.ticket, *span);
        if (!frees && (found || !reads_.counts(job.ticket, *span))) continue;
        const std::size_t rank = rank_of(job);
        found = Victim{at.place, i, frees, rank == kWrite, {}, {frees, rank, job.ticket}};
        if (frees) break;
    }
    const auto younger_beyond = [&](const auto& other) {
        const bool beyond = other.first != station && (station == 0 || other.first == 0);
        return beyond && other.second.jobs.back().job.ticket > jobs[found->index].job.ticket;
    };
    if (found && std::ranges::any_of(at.source.lanes, younger_beyond)) return std::nullopt;
    return found;
}

}  // namespace panelgate::arbiter
