#include "panelgate/base/series.hpp"

#include <algorithm>
#include <array>

namespace panelgate {

void SlotRing::put(TimePoint at, double value) {
    const std::int64_t slot = slot_of(at);
    if (!newest_) newest_ = slot - ring_size();
    if (slot <= *newest_ - ring_size()) return;
    for (std::int64_t n = std::max(*newest_, slot - ring_size()) + 1; n <= slot; ++n)
        values_[index_of(n)] = std::numeric_limits<double>::quiet_NaN();
    newest_ = std::max(*newest_, slot);
    values_[index_of(slot)] = value;
}

std::optional<double> SlotRing::at(TimePoint at) const {
    const std::int64_t slot = slot_of(at);
    if (!newest_ || slot > *newest_ || slot <= *newest_ - ring_size()) return std::nullopt;
    const double value = values_[index_of(slot)];
    return std::isnan(value) ? std::nullopt : std::optional(value);
}

Duration slot_width(std::size_t rings, Duration span, Duration narrowest, std::size_t bytes) {
    constexpr std::array<Duration, 10> kWidths{1s, 2s, 5s, 10s, 20s, 30s, 60s, 120s, 300s, 600s};
    for (const Duration width : kWidths) {
        if (width < narrowest) continue;
        if (rings * slots_of(span, width) * SlotRing::kBytes <= bytes) return width;
    }
    return kWidths.back();
}

}  // namespace panelgate
