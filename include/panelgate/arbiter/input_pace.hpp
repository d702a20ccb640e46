#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>

#include "panelgate/arbiter/timing.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// When the bytes of one attempt are worth a look (P5): where bytes come one by one at the line's
/// rate, none decides before a header, an echo or the whole reply can be there. Pure.
class InputPace {
  public:
    /// `byte`: the time of one byte. `steady`: bytes arrive one by one, at the line's rate.
    InputPace(Duration byte, bool steady) : byte_(byte), steady_(steady) {}

    /// These bytes were read now.
    void on_read(TimePoint now, std::size_t bytes) {
        count_ += bytes;
        looked_ = now;
        const TimePoint began = now - count_ * byte_;
        // Bytes that came together, or after a pause, are no measure of the ones to come.
        steady_ = steady_ && (!began_ || began >= *began_ - slack());
        if (!began_ || began > *began_ + slack()) {
            began_ = now - bytes * byte_;
            count_ = bytes;
        }
    }
    /// All but the last `rest` bytes were our echo.
    void restart(TimePoint now, std::size_t rest) {
        count_ = rest;
        began_.reset();
        if (rest > 0) began_ = now - rest * byte_;
    }
    /// Bytes before this time decide nothing, if `missing` more are needed; empty: each may decide.
    /// A reply that was cut short is noticed before twice the time that it has taken.
    std::optional<TimePoint> busy_until(std::size_t missing) const {
        if (!steady_ || !began_ || missing == 0) return std::nullopt;
        const TimePoint whole = *began_ + (count_ + missing) * byte_;
        return std::min(whole, looked_ + std::max(timing::kLongestLook, looked_ - *began_));
    }

  private:
    Duration slack() const { return std::max(2 * byte_, timing::kReadingSlack); }

    Duration byte_;
    bool steady_;
    std::optional<TimePoint> began_;  ///< when the bytes that were counted began
    std::size_t count_ = 0;
    TimePoint looked_{};
};

}  // namespace panelgate::arbiter
