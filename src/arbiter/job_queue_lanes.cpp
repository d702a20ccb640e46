// The lanes of the queue and its accounts: who waits where, who is in which round, what counts.

#include <algorithm>
#include <iterator>

#include "panelgate/arbiter/job_queue.hpp"

namespace panelgate::arbiter {

JobQueue::Entry JobQueue::entry_of(Job job) {
    std::optional<ReadSpan> span;
    const auto& items = job.request.span();
    if (items && !job.alone && job.station != 0) span = {job.station, *items};
    return {std::move(job), span};
}

/// A client stays where it is as long as something of it waits.
JobQueue::HostKey JobQueue::host_of(const Job& job) const {
    const auto home = home_.find(job.client);
    if (home != home_.end()) return home->second;
    return job.host == 0 ? HostKey{true, job.client} : HostKey{false, job.host};
}

/// Who is new comes in at the end of all rounds.
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

/// Where its ticket belongs: at the end when it is new, ahead when it was taken before.
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
    const auto change = static_cast<std::size_t>(by);  // wraps, and back
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

}  // namespace panelgate::arbiter
