#pragma once

#include <algorithm>
#include <optional>
#include <utility>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// The longest of what was seen lately: what a network did once is no reason to wait for ever.
/// Pure.
class Slowest {
  public:
    static constexpr int kWindow = 256;  ///< of the last so many all count; of two windows at most

    void add(Duration seen) {
        newer_ = std::max(newer_, seen);
        if (++count_ < kWindow) return;
        count_ = 0;
        older_ = std::exchange(newer_, Duration::min());
    }
    /// Nothing: none was seen.
    std::optional<Duration> value() const {
        const Duration longest = std::max(older_, newer_);
        return longest == Duration::min() ? std::nullopt : std::optional(longest);
    }

  private:
    Duration older_ = Duration::min();
    Duration newer_ = Duration::min();
    int count_ = 0;
};

/// The shortest, likewise. Pure.
class Quickest {
  public:
    static constexpr int kEnough = 16;  ///< fewer tell nothing of what is too quick

    void add(Duration seen) {
        slowest_.add(-seen);
        count_ = std::min(count_ + 1, kEnough);
    }
    /// Nothing: none was seen.
    std::optional<Duration> value() const {
        const auto longest = slowest_.value();
        return longest ? std::optional(-*longest) : std::nullopt;
    }
    bool known() const { return count_ >= kEnough; }

  private:
    Slowest slowest_;
    int count_ = 0;
};

}  // namespace panelgate::arbiter
