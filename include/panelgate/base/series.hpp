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

/// Rings of one number per time slot, fixed in memory. Slots never set or too old are absent. Pure.
/// `ring`: below the number of rings.
class SlotRings {
  public:
    static constexpr std::size_t kBytes = sizeof(double);  ///< per slot

    /// `width` of a slot and `slots` of a ring must be above 0.
    SlotRings(Duration width, std::size_t slots, std::size_t rings)
        : width_(width),
          size_(static_cast<std::int64_t>(slots)),
          values_(slots * rings, std::numeric_limits<double>::quiet_NaN()),
          newest_(rings, kNone) {}

    /// Sets the value of the slot that contains `at`; the last call wins. `value` is not NaN.
    /// Ignored if older than the oldest slot.
    void put(std::size_t ring, TimePoint at, double value);
    /// Calls `told(start of the slot, value)`, oldest first, for the slots that the ring covers at
    /// `now`.
    template <class Told>
    void each(std::size_t ring, TimePoint now, Told told) const {
        const std::int64_t newest = newest_[ring];
        if (newest == kNone) return;
        for (std::int64_t n = std::max(slot_of(now), newest) - size_ + 1; n <= newest; ++n) {
            const double value = values_[index_of(ring, n)];
            if (!std::isnan(value) && n > newest - size_) told(TimePoint(n * width_), value);
        }
    }
    /// Returns the value of the slot that contains `at`.
    std::optional<double> at(std::size_t ring, TimePoint at) const;
    /// Takes over a ring of `from`, whose slots are of the same width and number.
    void copy(std::size_t ring, const SlotRings& from, std::size_t from_ring);

  private:
    static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::min();

    std::int64_t slot_of(TimePoint at) const { return at.time_since_epoch() / width_; }
    std::size_t index_of(std::size_t ring, std::int64_t slot) const {
        const std::int64_t rest = slot % size_;
        return ring * static_cast<std::size_t>(size_) +
               static_cast<std::size_t>(rest < 0 ? rest + size_ : rest);
    }

    Duration width_;
    std::int64_t size_;                 ///< slots of a ring
    std::vector<double> values_;        ///< ring after ring
    std::vector<std::int64_t> newest_;  ///< slot of each ring
};

/// Number of slots of this width in `span`.
inline std::size_t slots_of(Duration span, Duration width) {
    return static_cast<std::size_t>(span / width);
}
/// Returns the narrowest slot width, at least `narrowest`, with which `rings` rings over `span` fit
/// into `bytes`; 600 s if none does.
Duration slot_width(std::size_t rings, Duration span, Duration narrowest, std::size_t bytes);

}  // namespace panelgate
