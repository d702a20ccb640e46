#include "panelgate/points/station_points.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>

#include "panelgate/points/station_polls.hpp"
#include "panelgate/points/value.hpp"

namespace panelgate::points {

std::vector<Want> wants_of(const std::vector<Point>& points, const std::vector<Poll>& polls) {
    std::vector<Want> wants;
    for (const Point& point : points)
        wants.push_back({{point.table, point.address, point.count()}, point.every});
    for (const Poll& poll : polls)
        wants.push_back({{poll.table, poll.address, poll.count}, poll.every});
    return wants;
}

const Point* StationPoints::find(std::string_view name) const {
    const auto found = std::ranges::find(*points_, name, &Point::name);
    return found == points_->end() ? nullptr : &*found;
}

const Point* StationPoints::point_of(std::size_t want) const {
    return want < points_->size() ? &(*points_)[want] : nullptr;
}

const Reading& StationPoints::reading(const Poll& block) const {
    const auto index = static_cast<std::size_t>(&block - blocks_->data());
    return (*readings_)[points_->size() + index];
}

const std::vector<std::uint16_t>& StationPoints::items(const Point& point) const {
    return (*readings_)[static_cast<std::size_t>(&point - points_->data())].values;
}

PointReading StationPoints::read(const Point& point, TimePoint now) const {
    const auto index = static_cast<std::size_t>(&point - points_->data());
    const Reading& reading = (*readings_)[index];
    PointReading made;
    made.quality = quality_of(reading, point.every, now);
    if (reading.sampled) made.age = now - *reading.sampled;
    if (made.quality == Quality::bad) return made;
    made.value = decode(point, reading.values);
    made.label = label_of(point, reading.values);
    if (!made.value) made.quality = Quality::bad;
    return made;
}

bool StationPoints::is_outdated(const Point& point) const {
    return (*readings_)[static_cast<std::size_t>(&point - points_->data())].outdated();
}

namespace {

/// Slot value where the point was bad; real values are finite.
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
    const Duration max_pause = std::max(bad_after(point.every), 2 * width_);
    const auto end_before = [&](TimePoint next) {
        if (samples.empty() || !samples.back().value || next - samples.back().at <= max_pause)
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
