#pragma once

#include <algorithm>
#include <cstddef>

#include "panelgate/base/time.hpp"

namespace panelgate::line {

/// How much of what a device says is read: replies to what was sent, and besides them no more than
/// a rate, but for a burst of kBurst at that rate. What is beyond stays with the kernel, and over
/// TCP with the sender. Pure.
class InputBudget {
  public:
    static constexpr Duration kBurst = 1s;
    static constexpr std::size_t kReply = 1024;  ///< bytes, more than any is

    /// `rate`: bytes a second, more than 0.
    explicit InputBudget(std::size_t rate) : rate_(rate) {}

    bool allows(TimePoint now) const { return paid_ <= now + kBurst; }
    void spend(TimePoint now, std::size_t bytes) {
        paid_ = std::max(paid_, now) + Duration(1s) * bytes / rate_;
    }
    void on_sent() { paid_ -= Duration(1s) * kReply / rate_; }
    /// Behind a burst half of it is waited for, so that reading goes in few large pieces.
    TimePoint next() const { return paid_ - kBurst / 2; }

  private:
    std::size_t rate_;
    TimePoint paid_{};
};

}  // namespace panelgate::line
