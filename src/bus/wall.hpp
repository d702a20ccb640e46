#pragma once

#include "panelgate/base/time.hpp"
#include "panelgate/base/wall_time.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::bus {

/// What the clock on the wall showed at an instant. It is asked now and then, not each time: when
/// somebody sets it, this follows a moment later.
class Wall {
  public:
    explicit Wall(rt::Clock& clock) : clock_(clock) {}

    WallTime at(TimePoint instant) {
        constexpr Duration kAgain = 100ms;
        if (instant >= asked_ + kAgain) {
            asked_ = clock_.now();
            shown_ = rt::wall_now();
        }
        return wall_time_of(instant, asked_, shown_);
    }

  private:
    rt::Clock& clock_;
    TimePoint asked_{};
    WallTime shown_{};
};

}  // namespace panelgate::bus
