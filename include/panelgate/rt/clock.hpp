#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

#include "panelgate/base/time.hpp"

namespace panelgate::rt {

/// One-shot timer, owned by the object it wakes. The handler does not run after cancel(), a new
/// arm() or the alarm's end, and never from inside these calls. The clock keeps the handler until
/// then, so it may own its owner.
class Alarm {
  public:
    using Handler = std::function<void()>;

    virtual ~Alarm() = default;
    /// A time in the past fires as soon as the loop runs.
    virtual void arm(TimePoint when, Handler ring) = 0;
    /// Like arm(), but compensates for the wake-up latency: for what is due on the wire.
    virtual void arm_sharp(TimePoint when, Handler ring) { arm(when, std::move(ring)); }
    virtual void cancel() = 0;
};

/// Monotonic time and alarms; tests replace it. Single-threaded; outlives its users.
class Clock {
  public:
    virtual ~Clock() = default;
    virtual TimePoint now() const = 0;
    virtual std::unique_ptr<Alarm> make_alarm() = 0;
};

/// Returns the wall-clock time, for traces.
WallTime wall_now();
/// Returns wall-clock seconds since 1970, for log lines, metrics and panels' clocks; never for
/// timing.
double wall_seconds();
/// The same in local time, as if it were UTC: what a clock on the wall shows.
std::int64_t local_wall_seconds();

}  // namespace panelgate::rt
