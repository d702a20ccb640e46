#pragma once

#include <optional>

#include "panelgate/arbiter/group.hpp"
#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/read_cache.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/bytes.hpp"

namespace panelgate::arbiter {

/// Where jobs come in: they get their ticket and their deadline, or an answer from memory. Pure.
class Reception {
  public:
    explicit Reception(const Settings& settings)
        : serial_(settings.serial), deadline_(settings.queue.deadline) {}

    /// For jobs from now on.
    void apply(const Settings& settings) {
        serial_ = settings.serial;
        deadline_ = settings.queue.deadline;
    }
    /// Its ticket, its deadline, and the last moment at which starting it makes sense: when the
    /// request, a gap and its normal reply still fit. Counting only the shortest reply, an
    /// exception, would fill an overloaded line with transactions whose answers come too late for
    /// everybody.
    void stamp(TimePoint now, Job& job);

    struct FromMemory {
        Ticket ticket = 0;
        ReadCache::Hit hit;
    };
    /// A value that was read lately, where the station's max_age allows it. Not for polls, which
    /// are to bring new ones.
    std::optional<FromMemory> from_memory(TimePoint now, const Job& job, Duration max_age);
    /// A read was answered by its station; `max_age`: of that.
    void on_read(const Group& group, const Bytes& reply, Duration max_age);
    ReadCache& memory() { return memory_; }

  private:
    SerialFormat serial_;
    Duration deadline_;
    ReadCache memory_;
    Ticket last_ticket_ = 0;
};

}  // namespace panelgate::arbiter
