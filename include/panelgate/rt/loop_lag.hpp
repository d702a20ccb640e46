#pragma once

#include <memory>

#include "panelgate/base/histogram.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::rt {

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

}  // namespace panelgate::rt
