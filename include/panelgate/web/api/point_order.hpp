#pragma once

#include <boost/json/object.hpp>
#include <cstdint>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/points/value.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

// A write of a point: the checks and the words of PUT .../points/{point}, also for those who do not
// come by HTTP.

/// What goes out, and what the point is when it is confirmed.
struct PointOrder {
    bus::Request request;
    points::PointWrite write;
};

/// 400 and 422 of a value that the point cannot be, 403 and 409 where nobody may write.
Parsed<PointOrder> order_of(const bus::BusClient& bus, std::uint8_t station,
                            const profile::PanelProfile& profile, const points::Point& point,
                            const points::Value& value);
/// What is told of it when it is over: {"transmitted","confirmed","value"}, or why it is not.
Parsed<boost::json::object> told(const PointOrder& order, const bus::Answer& answer,
                                 const profile::PanelProfile& profile);
/// {"transmitted": true, "confirmed": true} with what the point has become.
boost::json::object confirmed(const points::PointWrite& write);
/// What is wrong with the value, as a problem. `more`: what would help against too many digits.
Problem problem_of(const points::WriteRefusal& refusal, const char* more);

}  // namespace panelgate::web
