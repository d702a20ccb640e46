#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "panelgate/base/slot_ring.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/station_points.hpp"

namespace panelgate::points {

/// One value of a point's past.
struct HistorySample {
    TimePoint at;
    std::optional<double> value;  ///< nothing: it could not be read from here on
};

/// The last hour of the points of one station: the last good value of each slot of time. Memory is
/// fixed: eight bytes for each slot of each point but texts, 28.8 kB a point with slots of 1 s. The
/// slots are as narrow as kBytes for all points allows: 1 s up to 582 points, 5 s up to 2912.
/// Whole numbers are exact up to 2^53. Pure.
class StationHistory {
  public:
    static constexpr Duration kSpan = 1h;
    static constexpr Duration kNarrowest = 1s;
    static constexpr std::size_t kBytes = 16 * 1024 * 1024;  ///< of all points of the plant

    /// The slots, where there are so many points in all.
    static Duration width_for(std::size_t points) {
        return slot_width(points, kSpan, kNarrowest, kBytes);
    }
    /// The points outlive it.
    StationHistory(const std::vector<Point>& points, Duration width);
    /// The past of points that are the same as one of its is this one's, too, from now on for both.
    void adopt(const StationHistory& before);

    /// What has become of a point of the station. A stale value says nothing new.
    void record(TimePoint now, const Point& point, const PointReading& reading);
    /// Is anything kept of it? Not of texts.
    static bool keeps(const Point& point) { return point.type != Type::string; }
    /// The oldest first. Where a value was bad, or none came for as long as makes one bad, there is
    /// a sample without one.
    std::vector<HistorySample> samples(const Point& point, TimePoint now) const;
    Duration width() const { return width_; }

  private:
    const SlotRing& ring_of(const Point& point) const {
        return *rings_[static_cast<std::size_t>(&point - points_->data())];
    }

    const std::vector<Point>* points_;
    Duration width_;
    std::vector<std::shared_ptr<SlotRing>> rings_;  ///< one a point
};

}  // namespace panelgate::points
