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

bool JobQueue::is_aged(TimePoint now, const Job& job, PriorityClass over) const {
    const int steps = static_cast<int>(job.priority) - static_cast<int>(over);
    return steps > 0 &&
           now - job.arrived >= steps * std::min<Duration>(500ms, settings_.deadline / 8);
}

JobQueue::Choice JobQueue::choose(TimePoint now, const Test& may_run) const {
    Choice best{lanes_.end(), false};
    const auto rank = [](Lanes::const_iterator it) {
        return std::tuple(it->second.jobs.front().priority, it->second.turn);
    };
    for (auto it = lanes_.begin(); it != lanes_.end(); ++it) {
        if (!may_run(it->second.jobs.front())) continue;
        if (best.lane == lanes_.end() || rank(it) < rank(best.lane)) best.lane = it;
    }
    if (best.lane == lanes_.end() || last_was_aged_) return best;
    const PriorityClass over = best.lane->second.jobs.front().priority;
    for (auto it = lanes_.begin(); it != lanes_.end(); ++it) {
        const Job& job = it->second.jobs.front();
        if (!is_aged(now, job, over) || !may_run(job)) continue;
        if (!best.aged || job.arrived < best.lane->second.jobs.front().arrived) best = {it, true};
    }
    return best;
}

Job JobQueue::take(Lanes::const_iterator it) {
    Lane& lane = lanes_.find(it->first)->second;
    Job job = std::move(lane.jobs.front());
    lane.jobs.pop_front();
    if (lane.jobs.empty()) lanes_.erase(it);
    --size_;
    return job;
}

const Job* JobQueue::peek(TimePoint now, const Test& may_run) const {
    const Choice choice = choose(now, may_run);
    return choice.lane == lanes_.end() ? nullptr : &choice.lane->second.jobs.front();
}

std::optional<Job> JobQueue::pop(TimePoint now, const Test& may_run) {
    const Choice choice = choose(now, may_run);
    if (choice.lane == lanes_.end()) return std::nullopt;
    last_was_aged_ = choice.aged;
    lanes_.find(choice.lane->first)->second.turn = ++turns_;
    return take(choice.lane);
}

std::optional<Job> JobQueue::take_first(const Test& wanted) {
    for (auto it = lanes_.begin(); it != lanes_.end(); ++it) {
        if (wanted(it->second.jobs.front())) return take(it);
    }
    return std::nullopt;
}

std::vector<Job> JobQueue::remove_if(const Test& match) {
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

void JobQueue::each_first(const std::function<void(const Job&)>& show) const {
    for (const auto& [client, lane] : lanes_) show(lane.jobs.front());
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
