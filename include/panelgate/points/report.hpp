#pragma once

#include <cstdint>
#include <optional>

#include "panelgate/base/time.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/station_points.hpp"

namespace panelgate::points {

enum class Report : std::uint8_t {
    none,
    changed,  ///< the reading is news
    again     ///< only time has passed
};

/// What a subscriber was told of a point last, for the point's report rule. Pure.
class Told {
  public:
    /// Whether this reading is told now, by a rule that is not empty. What is told is remembered.
    /// The first reading and another quality are told at once.
    Report take(const ReportRule& rule, const PointReading& reading, TimePoint now);

  private:
    Report judge(const ReportRule& rule, const PointReading& reading, TimePoint now) const;

    std::optional<PointReading> last_;
    TimePoint at_{};
};

}  // namespace panelgate::points
