#pragma once

#include <boost/json/object.hpp>
#include <boost/json/value.hpp>

#include "panelgate/points/station_points.hpp"
#include "panelgate/points/value.hpp"

namespace panelgate::web {

boost::json::value json_of(const points::Value& value);

/// {"name","value","label","unit","quality","age_ms"} (README, REST).
boost::json::object point_json(const points::Point& point, const points::PointReading& reading);

}  // namespace panelgate::web
