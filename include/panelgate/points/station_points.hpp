#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

}  // namespace panelgate::points
