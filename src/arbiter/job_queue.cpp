#include "panelgate/arbiter/job_queue.hpp"

#include <algorithm>
#include <iterator>

namespace panelgate::arbiter {

namespace {

constexpr std::uint8_t kBroadcast = 0;
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

/// Lanes are in order of tickets, so the first ones tell; broadcasts are the first lane.
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

/// A lower class is never let ahead twice in a row, so that a write waits for one of them only.
JobQueue::Choice JobQueue::choose(const Test& may_run) const {
    Choice choice;
    for (std::size_t rank = kRanks; rank-- > 0;) {
        choice.first[rank] = first_of(rank, may_run);
        if (choice.first[rank]) choice.rank = rank;
    }
    if (choice.rank == kRanks || last_was_passed_over_) return choice;
    const std::size_t top = choice.rank;
    if (top < kRead && choice.first[kRead] && passed_[kRead] >= kReadTurn - 1) {
        choice.rank = kRead;
    } else if (top < kPoll && choice.first[kPoll] && is_polls_turn(choice, top)) {
        choice.rank = kPoll;
    }
    choice.passed_over = choice.rank != top;
    return choice;
}

/// Its last chance is the tenth turn. Where a read could then be in the way (it is due itself, or
/// would be in the turn that follows, which is a write's again), the poll goes up to three turns
/// earlier; with these, one of four turns in a row is always free for it.
bool JobQueue::is_polls_turn(const Choice& choice, std::size_t top) const {
    const bool read = choice.first[kRead].has_value();
    const int reads_wait = passed_[kRead];
    if (read && reads_wait >= kReadTurn - 2) return false;
    const bool in_the_way = top == kWrite && reads_wait + (read ? 1 : 0) >= kReadTurn - 2;
    return passed_[kPoll] >= kPollTurn - (in_the_way ? 4 : 1);
}

void JobQueue::count_turn(const Choice& choice) {
    last_was_passed_over_ = choice.passed_over;
    for (const std::size_t rank : {kRead, kPoll}) {
        if (rank == choice.rank || rounds_[rank].empty()) {
            passed_[rank] = 0;
        } else if (choice.first[rank]) {
            ++passed_[rank];
        }
    }
}

const Job* JobQueue::peek(const Test& may_run) const {
    const Choice choice = choose(may_run);
    return choice.rank == kRanks ? nullptr : &lane_at(*choice.first[choice.rank]).jobs.front().job;
}

std::optional<Job> JobQueue::pop(const Test& may_run) {
    const Choice choice = choose(may_run);
    if (choice.rank == kRanks) return std::nullopt;
    count_turn(choice);
    const Place place = *choice.first[choice.rank];
    to_the_end(place, choice.rank);
    return take(place, 0);
}

void JobQueue::to_the_end(const Place& place, std::size_t rank) {
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

/// There is such a lane, and order allows its first job to run.
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

}  // namespace panelgate::arbiter
