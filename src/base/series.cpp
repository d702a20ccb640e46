#include "panelgate/base/series.hpp"

#include <algorithm>
#include <array>

namespace panelgate {

void SlotRings::put(std::size_t ring, TimePoint at, double value) {
    std::int64_t& newest = newest_[ring];
    const std::int64_t slot = slot_of(at);
    if (newest == kNone) newest = slot - size_;
    if (slot <= newest - size_) return;
    for (std::int64_t n = std::max(newest, slot - size_) + 1; n <= slot; ++n)
        values_[index_of(ring, n)] = std::numeric_limits<double>::quiet_NaN();
    newest = std::max(newest, slot);
    values_[index_of(ring, slot)] = value;
}

std::optional<double> SlotRings::at(std::size_t ring, TimePoint at) const {
    const std::int64_t slot = slot_of(at);
    const std::int64_t newest = newest_[ring];
    if (newest == kNone || slot > newest || slot <= newest - size_) return std::nullopt;
    const double value = values_[index_of(ring, slot)];
    return std::isnan(value) ? std::nullopt : std::optional(value);
}

void SlotRings::copy(std::size_t ring, const SlotRings& from, std::size_t from_ring) {
    std::copy_n(from.values_.begin() + static_cast<std::ptrdiff_t>(from.index_of(from_ring, 0)),
                size_, values_.begin() + static_cast<std::ptrdiff_t>(index_of(ring, 0)));
    newest_[ring] = from.newest_[from_ring];
}

Duration slot_width(std::size_t rings, Duration span, Duration narrowest, std::size_t bytes) {
    constexpr std::array<Duration, 10> kWidths{1s, 2s, 5s, 10s, 20s, 30s, 60s, 120s, 300s, 600s};
    for (const Duration width : kWidths) {
        if (width < narrowest) continue;
        if (rings * slots_of(span, width) * SlotRings::kBytes <= bytes) return width;
    }
    return kWidths.back();
}

}  // namespace panelgate
