#include "panelgate/arbiter/backlog.hpp"

#include <algorithm>
#include <utility>

namespace panelgate::arbiter {

namespace {

void append(Jobs& jobs, Jobs more) {
    jobs.insert(jobs.end(), std::move_iterator(more.begin()), std::move_iterator(more.end()));
}

}  // namespace

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

void Backlog::each_retry(const InlineFunction<void(const Group&), 48>& show) const {
    for (const Group& group : retries_) show(group);
}

Jobs Backlog::remove_retries(const JobQueue::Test& match) {
    Jobs removed;
    for (auto group = retries_.begin(); group != retries_.end();) {
        std::ranges::copy_if(group->jobs, std::back_inserter(removed), match);
        std::erase_if(group->jobs, match);
        if (!group->abandoned()) {
            ++group;
            continue;
        }
        append(removed, std::exchange(group->jobs, {}));  // of those who left while it was sent
        dropped_.push_back(std::move(*group));
        group = retries_.erase(group);
    }
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

}  // namespace panelgate::arbiter
