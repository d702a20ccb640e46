#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/arbiter/group.hpp"
#include "panelgate/arbiter/job_queue.hpp"
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"

namespace panelgate::arbiter {

/// All that has been accepted and is not on the wire: requests that wait for their turn, and those
/// whose attempt failed and goes again. Pure.
class Backlog {
  public:
    explicit Backlog(const QueueSettings& settings) : queue_(settings) {}

    JobQueue& queue() { return queue_; }
    const JobQueue& queue() const { return queue_; }
    bool empty() const { return queue_.empty() && retries_.empty(); }
    /// Something of this client waits for this station.
    bool has(Client client, std::uint8_t station) const;

    /// The same request goes again. At most one a station.
    void retry(Group group) { retries_.push_back(std::move(group)); }
    bool has_retries() const { return !retries_.empty(); }
    bool has_retry(std::uint8_t station) const {
        return std::ranges::any_of(retries_,
                                   [&](const Group& group) { return group.station == station; });
    }
    std::optional<Group> take_retry(const InlineFunction<bool(const Group&), 48>& may_go);
    void each_retry(const InlineFunction<void(const Group&), 48>& show) const;

    /// Retries that nobody waits for any more, without their jobs: what failed has failed.
    std::vector<Group> take_dropped() { return std::exchange(dropped_, {}); }

    /// What this client has waiting; it is gone then.
    Jobs cancel(Client client);
    /// Those that can no longer be started, or, transmitted before, answered in time.
    Jobs expire(TimePoint now);
    std::optional<TimePoint> first_expiry() const;
    /// Those that match, waiting for their first turn.
    Jobs remove_if(const JobQueue::Test& match) { return queue_.remove_if(match); }
    /// Everything.
    Jobs clear();

  private:
    Jobs remove_retries(const JobQueue::Test& match);

    JobQueue queue_;
    PoolDeque<Group> retries_;
    std::vector<Group> dropped_;
};

}  // namespace panelgate::arbiter
