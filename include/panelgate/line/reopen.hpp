#pragma once

#include <algorithm>

#include "panelgate/base/time.hpp"

namespace panelgate::line {

/// Back-off between attempts to open a device: doubles from min to max. Pure.
class Reopen {
  public:
    Reopen(Duration min, Duration max) : min_(min), max_(max), next_(min) {}
    /// Returns the pause before the next attempt.
    Duration next_pause() {
        const Duration pause = next_;
        next_ = std::min(max_, next_ * 2);
        return pause;
    }
    /// Resets the back-off to min.
    void succeeded() { next_ = min_; }

  private:
    Duration min_;
    Duration max_;
    Duration next_;
};

}  // namespace panelgate::line
