#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/base/series.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/settings.hpp"

namespace panelgate::rt {

/// Raises the soft limit of open files to the hard limit. Returns the resulting limit.
std::size_t raise_descriptor_limit();

/// Divides `available` descriptors: all get what they ask for, or all the same part of it, but
/// never less than one.
std::vector<std::size_t> share_descriptors(std::size_t available,
                                           const std::vector<std::size_t>& asked);

/// Applies `settings` to the calling thread (and all memory), and asks for punctual sleeps, which
/// need no privilege. Returns a line per refused setting: which, why, and what would grant it.
std::vector<std::string> be_punctual(const RealtimeSettings& settings);

/// Measures loop lag: a periodic alarm records how late it fires. A blocked loop misses ticks and
/// records one late tick for them.
class LoopLag {
  public:
    static constexpr Duration kEvery = 100ms;

    /// The clock outlives it.
    explicit LoopLag(Clock& clock) : clock_(clock), alarm_(clock.make_alarm()) {}
    LoopLag(const LoopLag&) = delete;
    LoopLag& operator=(const LoopLag&) = delete;

    void start();
    void stop() { alarm_->cancel(); }
    /// Lag in seconds, one sample per 100 ms.
    const Histogram& seconds() const { return seconds_; }

  private:
    void arm(TimePoint due);

    Clock& clock_;
    std::unique_ptr<Alarm> alarm_;
    Histogram seconds_;
};

/// Argument of sched_getattr(2) and sched_setattr(2), first version: glibc has no declaration, and
/// <linux/sched/types.h> clashes with <sched.h>.
struct SchedAttr {
    std::uint32_t size = sizeof(SchedAttr);
    std::uint32_t policy = 0;
    std::uint64_t flags = 0;
    std::int32_t nice = 0;
    std::uint32_t priority = 0;
    std::uint64_t runtime = 0;  ///< ns; for SCHED_OTHER the time slice
    std::uint64_t deadline = 0;
    std::uint64_t period = 0;
};

}  // namespace panelgate::rt
