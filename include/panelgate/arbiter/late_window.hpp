#pragma once

#include <algorithm>
#include <optional>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// How long after a timeout a reply of one station may still come. Auto starts at the response
/// timeout, grows to one and a half times the lateness seen, at most to eight timeouts, and shrinks
/// again while replies come in time: one that was late once is no reason to wait for ever. Pure.
class LateWindow {
  public:
    static constexpr int kForget = 512;  ///< replies in time, after which it shrinks by a third

    LateWindow(std::optional<Duration> fixed, Duration response_timeout)
        : fixed_(fixed), timeout_(response_timeout), window_(response_timeout) {}

    /// What has grown does not shrink by that.
    void apply(std::optional<Duration> fixed, Duration response_timeout) {
        fixed_ = fixed;
        timeout_ = response_timeout;
        window_ = std::max(window_, timeout_);
    }
    Duration value() const { return fixed_.value_or(window_); }
    /// A reply came this long after the timeout of its request.
    void on_late(Duration lateness) {
        worst_ = std::max(worst_, lateness);
        ++late_;
        window_ = std::clamp(lateness * 3 / 2, window_, std::max(window_, 8 * timeout_));
        timely_ = 0;
    }
    void on_timely() {
        ++timely_;
        if (timely_ % kHabit == 0) late_ /= 2;
        if (late_ == 0) worst_ = {};
        if (timely_ < kForget) return;
        timely_ = 0;
        window_ = std::max(timeout_, window_ * 2 / 3);
    }
    /// The longest lateness seen lately; 0: to be late is no habit of this station.
    Duration worst() const { return late_ < 2 ? Duration::zero() : worst_; }

  private:
    static constexpr int kHabit = 64;  ///< replies in time, after which half is forgiven

    std::optional<Duration> fixed_;
    Duration timeout_;
    Duration window_;
    Duration worst_{};
    int timely_ = 0;
    int late_ = 0;  ///< replies, lately
};

}  // namespace panelgate::arbiter
