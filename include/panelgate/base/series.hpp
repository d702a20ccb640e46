#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "panelgate/base/time.hpp"

namespace panelgate {

/// Counts durations in fixed buckets (upper bounds in seconds, Prometheus style).
struct Histogram {
    static constexpr std::array<double, 14> kBounds = {0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1,
                                                       0.2,   0.5,   1.0,   2.0,  5.0,  10.0, 30.0};

    void observe(Duration d) {
        const double seconds = to_seconds(d);
        std::size_t i = 0;
        while (i < kBounds.size() && seconds > kBounds[i]) ++i;
        ++counts[i];
        sum += seconds;
    }

    std::array<std::uint64_t, kBounds.size() + 1> counts{};  ///< not cumulative; the last is +Inf
    double sum = 0;
};

/// Ring of one number per time slot, fixed in memory. Slots never set or too old are absent. Pure.
class SlotRing {
  public:
    static constexpr std::size_t kBytes = sizeof(double);  ///< per slot

    /// `width` of a slot and `slots` must be above 0.
    SlotRing(Duration width, std::size_t slots)
        : width_(width), values_(slots, std::numeric_limits<double>::quiet_NaN()) {}

    /// Sets the value of the slot that contains `at`; the last call wins. `value` is not NaN.
    /// Ignored if older than the oldest slot.
    void put(TimePoint at, double value);
    /// Calls `told(start of the slot, value)`, oldest first, for the slots that the ring covers at
    /// `now`.
    template <class Told>
    void each(TimePoint now, Told told) const {
        if (!newest_) return;
        const std::int64_t size = ring_size();
        for (std::int64_t n = std::max(slot_of(now), *newest_) - size + 1; n <= *newest_; ++n) {
            const double value = values_[index_of(n)];
            if (!std::isnan(value) && n > *newest_ - size) told(begin_of(n), value);
        }
    }
    /// Returns the value of the slot that contains `at`.
    std::optional<double> at(TimePoint at) const;

  private:
    std::int64_t ring_size() const { return static_cast<std::int64_t>(values_.size()); }
    std::int64_t slot_of(TimePoint at) const { return at.time_since_epoch() / width_; }
    TimePoint begin_of(std::int64_t slot) const { return TimePoint(slot * width_); }
    std::size_t index_of(std::int64_t slot) const {
        const std::int64_t rest = slot % ring_size();
        return static_cast<std::size_t>(rest < 0 ? rest + ring_size() : rest);
    }

    Duration width_;
    std::vector<double> values_;
    std::optional<std::int64_t> newest_;
};

/// Number of slots of this width in `span`.
inline std::size_t slots_of(Duration span, Duration width) {
    return static_cast<std::size_t>(span / width);
}
/// Returns the narrowest slot width, at least `narrowest`, with which `rings` rings over `span` fit
/// into `bytes`; 600 s if none does.
Duration slot_width(std::size_t rings, Duration span, Duration narrowest, std::size_t bytes);

}  // namespace panelgate
