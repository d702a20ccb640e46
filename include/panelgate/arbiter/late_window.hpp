#pragma once

#include <algorithm>
#include <optional>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// How long after a timeout a reply of one station may still come. Auto starts at the response
/// timeout and grows to one and a half times the lateness seen, at most to eight timeouts. Pure.
class LateWindow {
  public:
    LateWindow(std::optional<Duration> fixed, Duration response_timeout)
        : fixed_(fixed), timeout_(response_timeout), window_(response_timeout) {}

    Duration value() const { return fixed_.value_or(window_); }
    /// A reply came this long after the timeout of its request.
    void on_late(Duration lateness) {
        worst_ = std::max(worst_, lateness);
        window_ = std::clamp(lateness * 3 / 2, window_, 8 * timeout_);
    }
    /// The longest lateness seen; the timeout to raise to is this and the old timeout.
    Duration worst() const { return worst_; }

  private:
    std::optional<Duration> fixed_;
    Duration timeout_;
    Duration window_;
    Duration worst_{};
};

}  // namespace panelgate::arbiter
