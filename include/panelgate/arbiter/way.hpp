#pragma once

#include <algorithm>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// What is known of the way to the wire, where it may hold frames back and deliver them later (RTU
/// over TCP). A connection proves nothing: the kernel of a device server that hangs takes it, and
/// what was sent on the one before may be served, and answered, behind that. Pure.
class Way {
  public:
    void on_opened(TimePoint now) { opened_ = now; }
    /// A request that was started then has been answered.
    void on_proved(TimePoint started) { proved_ = std::max(proved_, started); }

    /// What was sent before then has passed.
    TimePoint proved() const { return proved_; }
    /// What was sent before then was sent on another connection.
    TimePoint opened() const { return opened_; }

  private:
    TimePoint opened_{};
    TimePoint proved_{};
};

}  // namespace panelgate::arbiter
