#pragma once

#include <boost/json/object.hpp>
#include <boost/json/value.hpp>
#include <cstdint>
#include <string_view>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// A point's value in JSON, with every digit; for json_text().
boost::json::value json_of(const points::Value& value);

/// Parses any JSON text. 400 with line and column of the error; a duplicate member is an error,
/// too, at any depth.
Parsed<boost::json::value> parse_json(std::string_view text);
/// The new value of a point, as the client has sent it.
Parsed<points::Value> value_of(const boost::json::value& value);

// Writes of a point: the checks and messages of PUT .../points/{point}, also for clients other than
// HTTP.

/// The request to send, and the point's value once the panel has confirmed it.
struct PointOrder {
    bus::Request request;
    points::PointWrite write;
};

/// Plans a write. 400 or 422 for a value that the point cannot take, 403 or 409 where writing is
/// not allowed.
Parsed<PointOrder> order_of(const bus::RequestPort& bus, std::uint8_t station,
                            const profile::PanelProfile& profile, const points::Point& point,
                            const points::Value& value);
/// The result of a finished write: {"transmitted","confirmed","value"}, or why it failed.
Parsed<boost::json::object> write_result(const PointOrder& order, const bus::Answer& answer,
                                         const profile::PanelProfile& profile);
/// {"transmitted": true, "confirmed": true} with the new value of the point.
boost::json::object confirmed(const points::PointWrite& write);
/// The refusal as a problem. `more` is a hint added where the value has too many digits.
Problem problem_of(const points::WriteRefusal& refusal, const char* more);

}  // namespace panelgate::web
