#include "panelgate/points/station_points.hpp"

#include <algorithm>

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

}  // namespace panelgate::points
