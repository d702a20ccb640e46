#pragma once

#include <cstddef>

#include "panelgate/arbiter/group.hpp"
#include "panelgate/arbiter/job_queue.hpp"
#include "panelgate/arbiter/shared_read.hpp"
#include "panelgate/arbiter/station.hpp"
#include "panelgate/base/pool.hpp"

namespace panelgate::arbiter {

/// Which reads go together in one transaction (P6), and what came of it. Pure.
class Sharing {
  public:
    static constexpr std::size_t kRemembered = 64;

    explicit Sharing(bool share) : share_(share) {}
    void apply(bool share) { share_ = share; }

    /// The leader and what the same transaction can answer: contained reads always; touching ones
    /// as far as the panel is known to take the length. One request saves a request, a reply header
    /// and two gaps, so joining reads without a hole is always cheaper on the wire.
    Group gather(Job leader, const Station& station, JobQueue& queue) const;
    /// The joined read did not come about: its parts go alone from now on. Gives them in the order
    /// in which they are to be put back in front of the queue; what asked for the whole, and what
    /// nobody waits for any more, stays in the group.
    Jobs split(Group& group);
    /// What of `reply` answers this job of the group.
    static Bytes part_for(const Group& group, const Bytes& reply, const Job& job);

  private:
    bool joins(const Group& group, const Job& job, const Station& station) const;

    bool share_;
    PoolDeque<ReadSpan> refused_;
};

}  // namespace panelgate::arbiter
