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

/// Lets this process open as many files as it may: the soft limit becomes the hard one. What the
/// limit is then.
std::size_t raise_descriptor_limit();

/// `available` descriptors for those who ask for so many each: all that they ask for, or the same
/// part of it for everybody, but never less than one.
std::vector<std::size_t> share_descriptors(std::size_t available,
                                           const std::vector<std::size_t>& asked);

/// Asks the system for what `settings` want, for the calling thread (and all memory), and for
/// sleeps that end on time beside programs that compute, which is free. A line for each wish that
/// was not granted: which, why, and what would grant it.
std::vector<std::string> be_punctual(const RealtimeSettings& settings);

/// How late the loop comes to its timers: a steady alarm that notes how long after its time it
/// rang. A loop that is held for long misses turns, and is late once for all of them.
class LoopLag {
  public:
    static constexpr Duration kEvery = 100ms;

    /// The clock outlives it.
    explicit LoopLag(Clock& clock) : clock_(clock), alarm_(clock.make_alarm()) {}
    LoopLag(const LoopLag&) = delete;
    LoopLag& operator=(const LoopLag&) = delete;

    void start();
    void stop() { alarm_->cancel(); }
    /// In seconds, one sample each 100 ms.
    const Histogram& seconds() const { return seconds_; }

  private:
    void arm(TimePoint due);

    Clock& clock_;
    std::unique_ptr<Alarm> alarm_;
    Histogram seconds_;
};

/// What sched_getattr(2) and sched_setattr(2) exchange, as Linux has laid it out at first: glibc
/// has no declaration, and <linux/sched/types.h> clashes with <sched.h>.
struct SchedAttr {
    std::uint32_t size = sizeof(SchedAttr);
    std::uint32_t policy = 0;
    std::uint64_t flags = 0;
    std::int32_t nice = 0;
    std::uint32_t priority = 0;
    std::uint64_t runtime = 0;  ///< ns; of SCHED_OTHER: the slice
    std::uint64_t deadline = 0;
    std::uint64_t period = 0;
};

}  // namespace panelgate::rt
