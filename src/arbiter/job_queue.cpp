#include "panelgate/arbiter/job_queue.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "verdict.hpp"

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

const JobQueue::Lane& JobQueue::lane_at(const Place& place) const {
    return hosts_.at(place.host).sources.at(place.client).lanes.at(place.station);
}

/// Lanes are in order of tickets, so their first jobs decide; broadcasts are the first lane.
bool JobQueue::in_order(const Source& source, std::uint8_t station) {
    const auto& [first_station, first_lane] = *source.lanes.begin();
    if (first_station != kBroadcast) return true;
    const Ticket broadcast = first_lane.jobs.front().job.ticket;
    if (station != kBroadcast) return source.lanes.at(station).jobs.front().job.ticket < broadcast;
    return std::ranges::all_of(source.lanes, [&](const auto& other) {
        return broadcast <= other.second.jobs.front().job.ticket;
    });
}

std::optional<JobQueue::Place> JobQueue::first_of(std::size_t rank, const Test& may_run) const {
    for (const auto& [host_turn, host] : rounds_[rank]) {
        const Origin& origin = hosts_.at(host);
        for (const auto& [client_turn, client] : origin.rounds[rank]) {
            const Source& source = origin.sources.at(client);
            for (const auto& [turn, station] : source.rounds[rank]) {
                if (in_order(source, station) && may_run(source.lanes.at(station).jobs.front().job))
                    return Place{host, client, station};
            }
        }
    }
    return std::nullopt;
}

/// A lower class never goes ahead twice in a row, so that a write waits for only one.
JobQueue::Choice JobQueue::choose(const Test& may_run) const {
    Choice choice;
    for (std::size_t rank = kRanks; rank-- > 0;) {
        choice.first_[rank] = first_of(rank, may_run);
        if (choice.first_[rank]) choice.rank_ = rank;
    }
    if (choice.rank_ == kRanks) return choice;
    const std::size_t top = choice.rank_;
    if (last_was_passed_over_) {
        // The higher class goes.
    } else if (top < kRead && choice.first_[kRead] && passed_[kRead] >= kReadTurn - 1) {
        choice.rank_ = kRead;
    } else if (top < kPoll && choice.first_[kPoll] && is_polls_turn(choice, top)) {
        choice.rank_ = kPoll;
    }
    choice.passed_over_ = choice.rank_ != top;
    choice.job_ = &lane_at(*choice.first_[choice.rank_]).jobs.front().job;
    return choice;
}

/// Its last chance is the tenth turn. Where a read could then be in the way (because it is due
/// itself, or would be in the following turn, which is a write's again), the poll goes up to three
/// turns earlier; one of these four turns is always free for it.
bool JobQueue::is_polls_turn(const Choice& choice, std::size_t top) const {
    const bool read = choice.first_[kRead].has_value();
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
        } else if (choice.first_[rank]) {
            ++passed_[rank];
        }
    }
}

const Job* JobQueue::peek(const Test& may_run) const { return choose(may_run).job(); }

std::optional<Job> JobQueue::pop(const Test& may_run) {
    const Choice choice = choose(may_run);
    if (choice.job() == nullptr) return std::nullopt;
    return take(choice);
}

Job JobQueue::take(const Choice& choice) {
    count_turn(choice);
    const Place place = *choice.first_[choice.rank_];
    move_to_back(place, choice.rank_);
    return take(place, 0);
}

void JobQueue::move_to_back(const Place& place, std::size_t rank) {
    ++turns_;
    const auto move = [&](auto& rounds, Turns& turns) {
        auto node = rounds[rank].extract(turns[rank]);
        node.key() = turns[rank] = turns_;
        rounds[rank].insert(std::move(node));
    };
    Origin& origin = hosts_.at(place.host);
    Source& source = origin.sources.at(place.client);
    move(rounds_, origin.turns);
    move(origin.rounds, source.turns);
    move(source.rounds, source.lanes.at(place.station).turns);
}

Jobs JobQueue::take_all(std::uint8_t station, const Test& wanted) {
    Jobs taken;
    for (bool again = true; again;) {
        again = false;
        PoolMap<Ticket, Place> places;
        for (const auto& [host, origin] : hosts_) {
            for (const auto& [client, source] : origin.sources) {
                const auto lane = source.lanes.find(station);
                if (lane != source.lanes.end())
                    places.emplace(lane->second.jobs.front().job.ticket,
                                   Place{host, client, station});
            }
        }
        for (const auto& [ticket, place] : places) {
            while (has_first(place) && wanted(lane_at(place).jobs.front().job)) {
                taken.push_back(take(place, 0));
                again = true;
            }
        }
    }
    sort_by_ticket(taken);
    return taken;
}

/// True if the lane exists and order allows its first job to run.
bool JobQueue::has_first(const Place& place) const {
    const auto origin = hosts_.find(place.host);
    if (origin == hosts_.end()) return false;
    const auto source = origin->second.sources.find(place.client);
    return source != origin->second.sources.end() && source->second.lanes.contains(place.station) &&
           in_order(source->second, place.station);
}

Jobs JobQueue::remove_if(const Test& match) {
    PoolVector<std::pair<Place, std::size_t>> found;
    for (const auto& [host, origin] : hosts_) {
        for (const auto& [client, source] : origin.sources) {
            for (const auto& [station, lane] : source.lanes) {
                for (std::size_t i = 0; i < lane.jobs.size(); ++i) {
                    if (match(lane.jobs[i].job))
                        found.emplace_back(Place{host, client, station}, i);
                }
            }
        }
    }
    Jobs removed;
    for (auto it = found.rbegin(); it != found.rend(); ++it)
        removed.push_back(take(it->first, it->second));
    sort_by_ticket(removed);
    return removed;
}

bool JobQueue::any_first(const Test& match) const {
    for (const auto& [host, origin] : hosts_) {
        for (const auto& [client, source] : origin.sources) {
            for (const auto& [station, lane] : source.lanes) {
                if (in_order(source, station) && match(lane.jobs.front().job)) return true;
            }
        }
    }
    return false;
}

bool JobQueue::has(Client client, std::uint8_t station) const {
    const auto home = home_.find(client);
    if (home == home_.end()) return false;
    const auto& lanes = hosts_.at(home->second).sources.at(client).lanes;
    return lanes.contains(station) || lanes.contains(kBroadcast);
}

std::optional<TimePoint> JobQueue::first_expiry() const {
    if (expiries_.empty()) return std::nullopt;
    return *expiries_.begin();
}

// Lanes and accounting: waiting jobs, rounds and counts.

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

/// New entries join at the end of all rounds.
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
    const Place place{host_of(entry.job), entry.job.client, entry.job.station};
    Lane& lane = open_lane(place);
    if (!lane.jobs.empty()) delist(place);
    expiries_.insert(entry.job.start_by);
    if (entry.span) {
        reads_.add(entry.job, *entry.span, [this](Client client, int by) { count(client, by); });
    } else {
        count(entry.job.client, 1);
    }
    auto at = lane.jobs.end();
    while (at != lane.jobs.begin() && std::prev(at)->job.ticket > entry.job.ticket) --at;
    if (at == lane.jobs.end()) {
        lane.jobs.push_back(std::move(entry));
    } else {
        lane.jobs.insert(at, std::move(entry));
    }
    enlist(place);
}

Job JobQueue::take(const Place& place, std::size_t index) {
    Lane& lane = hosts_.at(place.host).sources.at(place.client).lanes.at(place.station);
    delist(place);
    const auto at = lane.jobs.begin() + static_cast<std::ptrdiff_t>(index);
    forget(*at);
    Job job = std::move(at->job);
    lane.jobs.erase(at);
    if (lane.jobs.empty()) {
        close(place);
    } else {
        enlist(place);
    }
    return job;
}

void JobQueue::forget(const Entry& entry) {
    expiries_.erase(expiries_.find(entry.job.start_by));
    if (entry.span) {
        reads_.remove(entry.job, *entry.span, [this](Client client, int by) { count(client, by); });
    } else {
        count(entry.job.client, -1);
    }
}

void JobQueue::count(Client client, int by) {
    Origin& origin = hosts_.at(home_.at(client));
    const auto change = static_cast<std::size_t>(by);  // unsigned wrap-around is intended
    origin.sources.at(client).counting += change;
    origin.counting += change;
    size_ += change;
}

/// The class of its first job decides in which rounds a lane takes part.
void JobQueue::enlist(const Place& place) {
    Origin& origin = hosts_.at(place.host);
    Source& source = origin.sources.at(place.client);
    const Lane& lane = source.lanes.at(place.station);
    const std::size_t rank = rank_of(lane.jobs.front().job);
    source.rounds[rank].emplace(lane.turns[rank], place.station);
    origin.rounds[rank].emplace(source.turns[rank], place.client);
    rounds_[rank].emplace(origin.turns[rank], place.host);
}

void JobQueue::delist(const Place& place) {
    Origin& origin = hosts_.at(place.host);
    Source& source = origin.sources.at(place.client);
    const Lane& lane = source.lanes.at(place.station);
    const std::size_t rank = rank_of(lane.jobs.front().job);
    source.rounds[rank].erase(lane.turns[rank]);
    if (!source.rounds[rank].empty()) return;
    origin.rounds[rank].erase(source.turns[rank]);
    if (origin.rounds[rank].empty()) rounds_[rank].erase(origin.turns[rank]);
}

void JobQueue::close(const Place& place) {
    Origin& origin = hosts_.at(place.host);
    Source& source = origin.sources.at(place.client);
    source.lanes.erase(place.station);
    if (!source.lanes.empty()) return;
    origin.sources.erase(place.client);
    home_.erase(place.client);
    if (origin.sources.empty()) hosts_.erase(place.host);
}

bool JobQueue::source_consistent(Client client, const HostKey& host, const Source& source) const {
    std::size_t counting = 0;
    std::array<std::size_t, kRanks> enlisted{};
    for (const auto& [station, lane] : source.lanes) {
        if (lane.jobs.empty()) return false;
        const std::size_t rank = rank_of(lane.jobs.front().job);
        const auto turn = source.rounds[rank].find(lane.turns[rank]);
        if (turn == source.rounds[rank].end() || turn->second != station) return false;
        ++enlisted[rank];
        for (std::size_t i = 0; i < lane.jobs.size(); ++i) {
            const auto& [job, span] = lane.jobs[i];
            if (job.client != client || job.station != station) return false;
            if (i > 0 && lane.jobs[i - 1].job.ticket >= job.ticket) return false;
            if (!span || reads_.counts(job.ticket, *span)) ++counting;
        }
    }
    for (std::size_t rank = 0; rank < kRanks; ++rank) {
        const auto& round = hosts_.at(host).rounds[rank];
        const auto turn = round.find(source.turns[rank]);
        const bool listed = turn != round.end() && turn->second == client;
        if (enlisted[rank] != source.rounds[rank].size() || listed == source.rounds[rank].empty())
            return false;
    }
    return !source.lanes.empty() && counting == source.counting && home_.at(client) == host;
}

bool JobQueue::consistent() const {
    std::size_t counting = 0;
    std::size_t waiting = 0;
    std::size_t clients = 0;
    for (const auto& [host, origin] : hosts_) {
        std::size_t of_host = 0;
        for (const auto& [client, source] : origin.sources) {
            if (!source_consistent(client, host, source)) return false;
            of_host += source.counting;
            ++clients;
            for (const auto& [station, lane] : source.lanes) waiting += lane.jobs.size();
        }
        if (origin.sources.empty() || of_host != origin.counting) return false;
        counting += of_host;
        for (std::size_t rank = 0; rank < kRanks; ++rank) {
            const auto turn = rounds_[rank].find(origin.turns[rank]);
            const bool listed = turn != rounds_[rank].end() && turn->second == host;
            if (listed == origin.rounds[rank].empty()) return false;
        }
    }
    return counting == size_ && waiting == expiries_.size() && clients == home_.size() &&
           reads_.consistent();
}

// Admission to the queue, and dropping jobs for it.

JobQueue::PushResult JobQueue::push(Job job) {
    PushResult result;
    if (waiting() >= kMost) return result;
    Entry entry = entry_of(std::move(job));
    if (!entry.span || !reads_.carries(*entry.span)) {
        if (counting_of(entry.job.client) >= settings_.per_client) return result;
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
    if (first->merit.makes_room) {
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

std::size_t JobQueue::counting_of(Client client) const {
    const auto home = home_.find(client);
    return home == home_.end() ? 0 : hosts_.at(home->second).sources.at(client).counting;
}

std::optional<JobQueue::Victim> JobQueue::find_victim(const Job& newcomer) const {
    const HostKey own = host_of(newcomer);
    const auto origin = hosts_.find(own);
    const std::size_t of_host = origin == hosts_.end() ? 0 : origin->second.counting;
    const std::size_t of_client = counting_of(newcomer.client);
    const bool write = newcomer.priority == PriorityClass::write;
    const auto writes_too = [&](const Holder& holder) {
        return write || 2 * holder.origin.counting > size_;
    };
    auto victim = greediest(
        [&](const Holder& holder) { return holder.origin.counting > of_host + 1; }, writes_too);
    if (victim) return victim;
    victim = greediest(
        [&](const Holder& holder) {
            return holder.host == own && holder.source.counting > of_client + 1;
        },
        writes_too);
    // Writes come first, but not at the expense of the places of reads that every fifth turn needs.
    if (victim || !write || kReadTurn * reads_.counting() <= settings_.limit) return victim;
    return greediest(
        [&](const Holder& holder) {
            return holder.host == own ? holder.source.counting >= of_client
                                      : holder.origin.counting >= of_host;
        },
        [](const Holder&) { return false; });
}

/// The victim of the client with the most requests that has one. Among equals the newest request is
/// dropped, so that not always the same client loses.
std::optional<JobQueue::Victim> JobQueue::greediest(const Ask& may_lose,
                                                    const Ask& writes_too) const {
    std::optional<Victim> best;
    std::pair<std::size_t, std::size_t> most;
    for (const auto& [host, origin] : hosts_) {
        for (const auto& [client, source] : origin.sources) {
            const std::pair load(origin.counting, source.counting);
            const Holder holder{host, origin, client, source};
            if ((best && load < most) || !may_lose(holder)) continue;
            const auto victim = victim_of(holder, writes_too(holder));
            if (!victim || (best && load == most && victim->merit < best->merit)) continue;
            best = victim;
            most = load;
        }
    }
    return best;
}

std::optional<JobQueue::Victim> JobQueue::victim_of(const Holder& holder, bool writes_too) const {
    std::optional<Victim> best;
    for (const auto& [station, lane] : holder.source.lanes) {
        const auto victim = victim_in(holder, station);
        if (!victim || (victim->merit.is_write && !writes_too)) continue;
        if (!best || best->merit < victim->merit) best = victim;
    }
    return best;
}

/// The newest of a lane whose removal frees a place; if there is none, because carried reads would
/// count instead, the newest that counts. Only reads remain behind it, so its removal breaks no
/// order; likewise nothing younger may wait across a broadcast.
std::optional<JobQueue::Victim> JobQueue::victim_in(const Holder& holder,
                                                    std::uint8_t station) const {
    const auto& lanes = holder.source.lanes;
    const auto& jobs = lanes.at(station).jobs;
    std::optional<Victim> found;
    for (std::size_t i = jobs.size(); i-- > 0;) {
        const auto& [job, span] = jobs[i];
        const bool frees = !span || reads_.frees(job.ticket, *span);
        if (!frees && (found || !reads_.counts(job.ticket, *span))) continue;
        const std::size_t rank = rank_of(job);
        found = Victim{Place{holder.host, holder.client, station}, i,
                       Merit{rank == 0, frees, rank, job.ticket}};
        if (frees) break;
    }
    const auto younger_beyond = [&](const auto& other) {
        const bool beyond = other.first != station && (station == 0 || other.first == 0);
        return beyond && other.second.jobs.back().job.ticket > found->merit.ticket;
    };
    if (found && std::ranges::any_of(lanes, younger_beyond)) return std::nullopt;
    return found;
}

}  // namespace panelgate::arbiter
