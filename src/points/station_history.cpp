#include "panelgate/points/station_history.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "panelgate/points/station_polls.hpp"
#include "panelgate/points/value.hpp"

namespace panelgate::points {
namespace {

/// What a slot holds where the point was bad; values are finite.
constexpr double kBad = std::numeric_limits<double>::infinity();

}  // namespace

StationHistory::StationHistory(const std::vector<Point>& points, Duration width)
    : points_(&points), width_(width) {
    rings_.reserve(points.size());
    for (const Point& point : points)
        rings_.emplace_back(width, keeps(point) ? slots_of(kSpan, width) : 1);
}

void StationHistory::record(TimePoint now, const Point& point, const PointReading& reading) {
    if (!keeps(point) || reading.quality == Quality::stale) return;
    SlotRing& ring = rings_[static_cast<std::size_t>(&point - points_->data())];
    if (reading.quality == Quality::bad) return ring.put(now, kBad);
    const auto value = reading.value ? number_of(*reading.value) : std::nullopt;
    if (value && std::isfinite(*value)) ring.put(now - reading.age.value_or(Duration{}), *value);
}

std::vector<HistorySample> StationHistory::samples(const Point& point, TimePoint now) const {
    std::vector<HistorySample> samples;
    const Duration patience = std::max(bad_after(point.every), 2 * width_);
    const auto end_before = [&](TimePoint next) {
        if (samples.empty() || !samples.back().value || next - samples.back().at <= patience)
            return;
        samples.push_back({samples.back().at + width_, std::nullopt});
    };
    ring_of(point).each(now, [&](TimePoint at, double value) {
        end_before(at);
        if (std::isfinite(value)) {
            samples.push_back({at, value});
        } else if (samples.empty() || samples.back().value) {
            samples.push_back({at, std::nullopt});
        }
    });
    end_before(now);
    return samples;
}

}  // namespace panelgate::points
