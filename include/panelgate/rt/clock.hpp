#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

#include "panelgate/base/time.hpp"

namespace panelgate::rt {

/// Rings once, at a time. Belongs to whom it wakes: what was armed rings neither after cancel() nor
/// after arm() anew nor after the end of the alarm, and never from inside these calls. The handler
/// is kept by the clock until then, so it may hold its owner.
class Alarm {
  public:
    using Handler = std::function<void()>;

    virtual ~Alarm() = default;
    /// A time that has passed rings as soon as the loop runs.
    virtual void arm(TimePoint when, Handler ring) = 0;
    /// As arm(), and not late by what waking up takes: for what is due on the wire.
    virtual void arm_sharp(TimePoint when, Handler ring) { arm(when, std::move(ring)); }
    virtual void cancel() = 0;
};

/// Monotonic time and alarms: the time seam. One thread; it outlives whoever takes it.
class Clock {
  public:
    virtual ~Clock() = default;
    virtual TimePoint now() const = 0;
    virtual std::unique_ptr<Alarm> make_alarm() = 0;
};

/// Wall clock, for traces.
WallTime wall_now();
/// Wall clock: seconds since 1970, for log lines, metrics and panels' clocks; never for timing.
double wall_seconds();
/// The same as local time, as if it were UTC: what a clock on the wall shows.
std::int64_t local_wall_seconds();

}  // namespace panelgate::rt
