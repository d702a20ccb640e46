#include "panelgate/arbiter/queue/job_queue.hpp"

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
    for (const auto& [client, source] : clients_) {
        for (const auto& [station, lane] : source.lanes)
            if (visit(Found{{client, station}, source, lane})) return true;
    }
    return false;
}

const JobQueue::Source* JobQueue::find(Client client) const {
    const auto found = clients_.find(client);
    return found == clients_.end() ? nullptr : &found->second;
}

/// Lanes are in order of tickets, so their first jobs decide; broadcasts are the first lane.
const JobQueue::Entry* JobQueue::Source::first(std::uint8_t station) const {
    const auto lane = lanes.find(station);
    if (lane == lanes.end()) return nullptr;
    const Entry* const first = &lane->second.jobs.front();
    const auto is_before = [first](const Lane& other) {
        return first->job.ticket <= other.jobs.front().job.ticket;
    };
    const auto& [lowest, broadcasts] = *lanes.begin();
    if (lowest != kBroadcast) return first;
    if (station != kBroadcast) return is_before(broadcasts) ? first : nullptr;
    return std::ranges::all_of(lanes | std::views::values, is_before) ? first : nullptr;
}

/// The job of the first host in the round that has a runnable job.
std::pair<const Job*, JobQueue::Place> JobQueue::first_of(std::size_t rank,
                                                          const Test& may_run) const {
    std::pair<const Job*, Place> first;
    for (const auto& [host_turn, host] : rounds_[rank]) {
        std::pair<std::uint64_t, std::uint64_t> earliest;
        for (const Client client : hosts_.at(host).clients) {
            const Source& source = clients_.at(client);
            for (const auto& [station, lane] : source.lanes) {
                if (rank_of(lane.jobs.front().job) != rank) continue;
                const std::pair turn(source.turns[rank], lane.turns[rank]);
                if (first.first != nullptr && earliest < turn) continue;
                const Entry* const entry = source.first(station);
                if (entry == nullptr || !may_run(entry->job)) continue;
                first = {&entry->job, {client, station}};
                earliest = turn;
            }
        }
        if (first.first != nullptr) break;
    }
    return first;
}

/// A lower class never goes ahead twice in a row, so that a write waits for only one.
JobQueue::Choice JobQueue::choose(const Test& may_run) const {
    Choice choice;
    for (std::size_t rank = 0; rank < kRanks; ++rank) choice.first_[rank] = first_of(rank, may_run);
    std::size_t top = 0;
    while (top < kRanks && choice.first_[top].first == nullptr) ++top;
    choice.rank_ = top;
    if (last_was_passed_over_) return choice;  // the higher class goes
    if (top < kRead && choice.first_[kRead].first != nullptr && passed_[kRead] >= kReadTurn - 1) {
        choice.rank_ = kRead;
    } else if (top < kPoll && choice.first_[kPoll].first != nullptr && is_polls_turn(choice, top)) {
        choice.rank_ = kPoll;
    }
    choice.passed_over_ = choice.rank_ != top;
    return choice;
}

/// Its last chance is the tenth turn. Where a read could then be in the way (because it is due
/// itself, or would be in the following turn, which is a write's again), the poll goes up to three
/// turns earlier; one of these four turns is always free for it.
bool JobQueue::is_polls_turn(const Choice& choice, std::size_t top) const {
    const bool read = choice.first_[kRead].first != nullptr;
    const int reads_wait = passed_[kRead];
    if (read && reads_wait >= kReadTurn - 2) return false;
    const bool in_the_way = top == kWrite && reads_wait + (read ? 1 : 0) >= kReadTurn - 2;
    return passed_[kPoll] >= kPollTurn - (in_the_way ? 4 : 1);
}

void JobQueue::count_turn(const Choice& choice) {
    last_was_passed_over_ = choice.passed_over_;
    for (const std::size_t rank : {kRead, kPoll}) {
        if (rank == choice.rank_ || rounds_[rank].empty()) {
            passed_[rank] = 0;
        } else if (choice.first_[rank].first != nullptr) {
            ++passed_[rank];
        }
    }
}

Job JobQueue::take(const Choice& choice) {
    count_turn(choice);
    const std::size_t rank = choice.rank_;
    const Place& place = choice.first_[rank].second;
    Source& source = clients_.at(place.client);
    Origin& origin = hosts_.at(source.host);
    Lane& lane = source.lanes.at(place.station);
    auto turn = rounds_[rank].extract(origin.turns[rank]);
    origin.turns[rank] = source.turns[rank] = lane.turns[rank] = turn.key() = ++turns_;
    rounds_[rank].insert(rounds_[rank].end(), std::move(turn));
    return take(place);
}

Jobs JobQueue::take_reads(std::uint8_t station, const Test& wanted) {
    Jobs taken;
    for (bool again = true; again;) {
        again = false;
        PoolMap<Ticket, Place> lanes;
        reads_.visit(station, [&](Client client) {
            const Lane& lane = find(client)->lanes.at(station);
            lanes.emplace(lane.jobs.front().job.ticket, Place{client, station});
        });
        for (const auto& [ticket, place] : lanes) {
            for (const Source* source = find(place.client); source != nullptr;
                 source = find(place.client)) {
                const Entry* const first = source->first(station);
                if (first == nullptr || !first->span || !wanted(first->job)) break;
                taken.push_back(take(place));
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
        const Entry* const first = at.source.first(at.place.station);
        return first != nullptr && match(first->job);
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

std::optional<ReadSpan> JobQueue::span_of(const Job& job) {
    const auto& items = job.request.span();
    if (!items || job.alone || job.station == 0) return std::nullopt;
    return ReadSpan{job.station, *items};
}

/// A client keeps its host while a job of it waits.
JobQueue::HostKey JobQueue::host_of(const Job& job) const {
    if (const Source* const known = find(job.client)) return known->host;
    return job.host == 0 ? HostKey{true, job.client} : HostKey{false, job.host};
}

/// Who is new has the last turn in all classes.
std::pair<JobQueue::Source&, JobQueue::Lane&> JobQueue::open_lane(const Job& job) {
    const auto open = [this](auto& map, const auto& key) -> auto& {
        const auto [it, added] = map.try_emplace(key);
        if (added) it->second.turns.fill(++turns_);
        return it->second;
    };
    const HostKey host = host_of(job);
    open(hosts_, host).clients.insert(job.client);
    Source& source = open(clients_, job.client);
    source.host = host;
    return {source, open(source.lanes, job.station)};
}

/// Inserts by ticket: at the end if it is new, further ahead if it was taken before.
void JobQueue::put_back(Job&& job) {
    const auto [source, lane] = open_lane(job);
    PoolDeque<Entry>& jobs = lane.jobs;
    const auto span = span_of(job);
    Entry entry{std::move(job), span};
    expiries_.insert(entry.job.start_by);
    count(entry, 1);
    auto at = jobs.end();
    while (at != jobs.begin() && std::prev(at)->job.ticket > entry.job.ticket) --at;
    if (at == jobs.begin()) {
        count_first(source.host, entry.job, 1);
        if (!jobs.empty()) count_first(source.host, jobs.front().job, -1);
    }
    jobs.insert(at, std::move(entry));
}

/// One lane of this host more, or less, has a job of this class first.
void JobQueue::count_first(const HostKey& host, const Job& job, int by) {
    const std::size_t rank = rank_of(job);
    Origin& origin = hosts_.at(host);
    if (origin.firsts[rank] == 0)
        rounds_[rank].emplace_hint(rounds_[rank].end(), origin.turns[rank], host);
    origin.firsts[rank] += static_cast<std::size_t>(by);  // unsigned wrap-around is intended
    if (origin.firsts[rank] == 0) rounds_[rank].erase(origin.turns[rank]);
}

Job JobQueue::take(const Place& place, std::size_t index) {
    Source& source = clients_.at(place.client);
    PoolDeque<Entry>& jobs = source.lanes.at(place.station).jobs;
    const auto at = jobs.begin() + static_cast<std::ptrdiff_t>(index);
    expiries_.erase(expiries_.find(at->job.start_by));
    count(*at, -1);
    if (index == 0) {
        if (jobs.size() > 1) count_first(source.host, jobs[1].job, 1);
        count_first(source.host, at->job, -1);
    }
    Job job = std::move(at->job);
    jobs.erase(at);
    if (jobs.empty()) source.lanes.erase(place.station);
    if (!source.lanes.empty()) return job;
    const auto host = hosts_.find(source.host);
    host->second.clients.erase(place.client);
    if (host->second.clients.empty()) hosts_.erase(host);
    clients_.erase(place.client);
    return job;
}

/// One more or less waits.
void JobQueue::count(const Entry& entry, int by) {
    const auto count = [this](Client client, int more) {
        const auto change = static_cast<std::size_t>(more);  // unsigned wrap-around is intended
        Source& source = clients_.at(client);
        source.counting += change;
        hosts_.at(source.host).counting += change;
        size_ += change;
    };
    if (!entry.span) return count(entry.job.client, by);
    if (by > 0) return reads_.add(entry.job, *entry.span, count);
    reads_.remove(entry.job, *entry.span, count);
}

// Admission to the queue, and dropping jobs for it.

JobQueue::PushResult JobQueue::push(Job& job) {
    PushResult result;
    if (waiting() >= kMost) return result;
    if (const auto span = span_of(job); !span || !reads_.carries(*span)) {
        const Source* const source = find(job.client);
        if (source != nullptr && source->counting >= settings_.per_client) return result;
        if (size_ >= settings_.limit && !make_room(job, result.shed)) return {};
    }
    result.taken = true;
    put_back(std::move(job));
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
    const auto host = hosts_.find(own);
    const Source* const source = find(newcomer.client);
    const std::size_t of_host = host == hosts_.end() ? 0 : host->second.counting;
    const std::size_t of_client = source == nullptr ? 0 : source->counting;
    const bool write = newcomer.priority == PriorityClass::write;
    // Writes come first, but not at the expense of the places of reads that every fifth turn needs.
    const bool replaces_reads = write && kReadTurn * reads_.counting() > settings_.limit;
    std::optional<Victim> best;
    any_lane([&](const Found& at) {
        const bool is_own = at.source.host == own;
        const std::size_t of_its_host = hosts_.at(at.source.host).counting;
        const std::size_t load = is_own ? at.source.counting : of_its_host;
        const std::size_t mine = is_own ? of_client : of_host;
        const bool greedier = load > mine + 1;
        if (!greedier && (load < mine || !replaces_reads)) return false;
        auto victim = victim_in(at);
        const bool writes_too = greedier && (write || 2 * of_its_host > size_);
        if (!victim || (!victim->is_no_write && !writes_too)) return false;
        const int level = !greedier ? 0 : is_own ? 1 : 2;
        victim->greed = {level, of_its_host, at.source.counting};
        if (!best || best->merit() < victim->merit()) best = victim;
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
        found = Victim{{}, rank != kWrite, frees, rank, job.ticket, at.place, i};
        if (frees) break;
    }
    const auto younger_beyond = [&](const auto& other) {
        const bool beyond = other.first != station && (station == 0 || other.first == 0);
        return beyond && other.second.jobs.back().job.ticket > found->ticket;
    };
    if (found && std::ranges::any_of(at.source.lanes, younger_beyond)) return std::nullopt;
    return found;
}

}  // namespace panelgate::arbiter
