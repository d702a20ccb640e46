#pragma once

#include <algorithm>

#include "panelgate/base/time.hpp"

namespace panelgate::line {

/// The pauses between attempts to open a device: doubled from min to max. Pure.
class Reopen {
  public:
    Reopen(Duration min, Duration max) : min_(min), max_(max), next_(min) {}
    /// The pause before the next attempt.
    Duration next_pause() {
        const Duration pause = next_;
        next_ = std::min(max_, next_ * 2);
        return pause;
    }
    /// It worked: the next failure starts small again.
    void succeeded() { next_ = min_; }

  private:
    Duration min_;
    Duration max_;
    Duration next_;
};

}  // namespace panelgate::line
