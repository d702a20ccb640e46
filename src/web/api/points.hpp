#pragma once

#include <boost/json/object.hpp>

#include "panelgate/points/station_points.hpp"
#include "panelgate/web/api/point_order.hpp"

namespace panelgate::web {

struct Reading;

/// {"name","value","label","unit","quality","age_ms"} (docs/reference/rest.md).
boost::json::object point_json(const points::Point& point, const points::PointReading& reading);
/// A point as its items have just been read.
points::PointReading point_reading(const points::Point& point, const Reading& reading);

}  // namespace panelgate::web
