#include "panelgate/points/station_history.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>

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
        rings_.push_back(
            std::make_shared<SlotRing>(width, keeps(point) ? slots_of(kSpan, width) : 1));
}

void StationHistory::adopt(const StationHistory& before) {
    if (before.width_ != width_) return;
    std::map<std::string_view, std::size_t> places;
    for (std::size_t i = 0; i < before.points_->size(); ++i)
        places.emplace((*before.points_)[i].name, i);
    for (std::size_t i = 0; i < points_->size(); ++i) {
        const auto found = places.find((*points_)[i].name);
        if (found != places.end() && (*before.points_)[found->second] == (*points_)[i])
            rings_[i] = before.rings_[found->second];
    }
}

void StationHistory::record(TimePoint now, const Point& point, const PointReading& reading) {
    if (!keeps(point) || reading.quality == Quality::stale) return;
    SlotRing& ring = *rings_[static_cast<std::size_t>(&point - points_->data())];
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
