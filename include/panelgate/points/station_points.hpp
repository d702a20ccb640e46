#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/series.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/points/station_polls.hpp"
#include "panelgate/points/value.hpp"

namespace panelgate::points {

/// What a point is, now. Never an old value as a new one (P10).
struct PointReading {
    std::optional<Value> value;        ///< nothing when it is bad, or a value that means none
    std::optional<std::string> label;  ///< the name of its raw value
    Quality quality = Quality::bad;
    std::optional<Duration> age;  ///< nothing when it was never read
};

/// What has to be polled for a station: its points first, in their order, then its poll blocks.
std::vector<Want> wants_of(const std::vector<Point>& points, const std::vector<Poll>& polls);

/// The points of one station over what its polls have brought, or what was heard. Pure; what it
/// refers to outlives it.
class StationPoints {
  public:
    /// `readings` are those of wants_of(points, blocks).
    StationPoints(const std::vector<Point>& points, const std::vector<Poll>& blocks,
                  const std::vector<Reading>& readings)
        : points_(&points), blocks_(&blocks), readings_(&readings) {}
    StationPoints(const std::vector<Point>& points, const std::vector<Poll>& blocks,
                  const StationPolls& polls)
        : StationPoints(points, blocks, polls.readings()) {}
    /// The same of polls or of what is heard, which it keeps.
    template <class Source>
    StationPoints(const std::vector<Point>& points, const std::vector<Poll>& blocks,
                  std::shared_ptr<const Source> source)
        : StationPoints(points, blocks, source->readings()) {
        kept_ = std::move(source);
    }

    const std::vector<Point>& points() const { return *points_; }
    const Point* find(std::string_view name) const;
    /// Whose want this is; null: a poll block's.
    const Point* point_of(std::size_t want) const;
    PointReading read(const Point& point, TimePoint now) const;
    /// What it was read from: registers, or bits as 0 and 1; empty until the first success.
    const std::vector<std::uint16_t>& items(const Point& point) const;
    const std::vector<Poll>& blocks() const { return *blocks_; }
    /// What has become of one of the blocks.
    const Reading& reading(const Poll& block) const;

  private:
    const std::vector<Point>* points_;
    const std::vector<Poll>* blocks_;
    const std::vector<Reading>* readings_;
    std::shared_ptr<const void> kept_;  ///< whose readings they are
};

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
