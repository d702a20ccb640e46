#include "panelgate/arbiter/job_queue.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace panelgate::arbiter {

bool JobQueue::full(Client client) const {
    if (size_ >= settings_.limit) return true;
    const auto found = lanes_.find(client);
    return found != lanes_.end() && found->second.jobs.size() >= settings_.per_client;
}

JobQueue::Lane& JobQueue::lane(Client client) {
    const auto [it, added] = lanes_.try_emplace(client);
    if (added) it->second.turn = ++turns_;
    return it->second;
}

void JobQueue::push(Job job) {
    lane(job.client).jobs.push_back(std::move(job));
    ++size_;
}

void JobQueue::put_back(Job job) {
    lane(job.client).jobs.push_front(std::move(job));
    ++size_;
}

JobQueue::Lanes::const_iterator JobQueue::next() const {
    const auto rank = [](const Lanes::value_type& entry) {
        return std::tuple(entry.second.jobs.front().priority, entry.second.turn);
    };
    return std::min_element(lanes_.begin(), lanes_.end(),
                            [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
}

const Job* JobQueue::peek() const {
    const auto it = next();
    return it == lanes_.end() ? nullptr : &it->second.jobs.front();
}

std::optional<Job> JobQueue::pop() {
    const auto it = next();
    if (it == lanes_.end()) return std::nullopt;
    Lane& lane = lanes_.find(it->first)->second;
    Job job = std::move(lane.jobs.front());
    lane.jobs.pop_front();
    lane.turn = ++turns_;
    if (lane.jobs.empty()) lanes_.erase(it);
    --size_;
    return job;
}

std::vector<Job> JobQueue::remove_if(const std::function<bool(const Job&)>& match) {
    std::vector<Job> removed;
    for (auto it = lanes_.begin(); it != lanes_.end();) {
        std::deque<Job> kept;
        for (Job& job : it->second.jobs) {
            if (match(job)) {
                removed.push_back(std::move(job));
            } else {
                kept.push_back(std::move(job));
            }
        }
        it->second.jobs = std::move(kept);
        it = it->second.jobs.empty() ? lanes_.erase(it) : std::next(it);
    }
    size_ -= removed.size();
    std::sort(removed.begin(), removed.end(),
              [](const Job& a, const Job& b) { return a.ticket < b.ticket; });
    return removed;
}

std::optional<TimePoint> JobQueue::first_expiry() const {
    std::optional<TimePoint> first;
    for (const auto& [client, lane] : lanes_) {
        for (const Job& job : lane.jobs) {
            if (!first || job.start_by < *first) first = job.start_by;
        }
    }
    return first;
}

}  // namespace panelgate::arbiter
