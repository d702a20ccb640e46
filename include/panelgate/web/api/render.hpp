#pragma once

#include <boost/json/object.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

// What the bus and the points say, as problems and JSON: for REST, events and MQTT.

/// The problem for a bus request without a reply (502 line down or damaged, 503 busy, 504 no reply
/// in time).
Problem problem_of(Fault fault, bool transmitted);
/// The problem for a request that the gateway refuses: 403 by access, 422 by a guard, 409 on a line
/// that only listens. Member "rule" is label(Rule).
Problem problem_of(const bus::Refusal& refusal);
/// The problem for an answer without a reply from a panel: refused by the gateway, or a fault.
Problem problem_of(const bus::Answer& answer);
/// The same, or the problem for a panel's exception reply, with its manual's meaning: 422 for codes
/// 1-4, 502 above. Nothing if the answer carries the requested data.
std::optional<Problem> problem_of(const bus::Answer& answer, const profile::PanelProfile& profile);
/// 422 for what the profile rules out before a request is made: nothing was sent.
Problem ruled_out(bus::Rule rule, std::string detail);

/// The bus request to a station (0: broadcast), or why it may not be transmitted.
Parsed<bus::Request> request_to(std::uint8_t station, Bytes pdu);
/// Reports a lack of write access (403, or 409 on a line that only listens) to this station, or (0)
/// for a broadcast, before any other problem of a planned write. A valid request passes: the bus
/// itself refuses, counts and logs it.
template <class T>
Parsed<T> unless_refused(Parsed<T> planned, const bus::RequestPort& bus, std::uint8_t station) {
    if (planned) return planned;
    if (const auto refusal = bus.write_refusal(station)) return problem_of(*refusal);
    return planned;
}

/// A write of a point: the request to send, and the point's value once the panel has confirmed it.
struct PointOrder {
    bus::Request request;
    points::PointWrite write;
};
/// Plans a write with the checks and messages of PUT .../points/{point}. 400 or 422 for a value
/// that the point cannot take, 403 or 409 where writing is not allowed.
Parsed<PointOrder> order_of(const bus::RequestPort& bus, std::uint8_t station,
                            const profile::PanelProfile& profile, const points::Point& point,
                            const points::Value& value);
/// The result of a finished write: {"transmitted","confirmed","value"}, or why it failed.
Parsed<boost::json::object> write_result(const PointOrder& order, const bus::Answer& answer,
                                         const profile::PanelProfile& profile);
/// {"transmitted": true, "confirmed": true}; of a point with its new value. `write`: null without
/// a point.
boost::json::object confirmed(const points::PointWrite* write);

/// {"name","value","label","unit","quality","age_ms"} (docs/reference/rest.md).
boost::json::object point_json(const points::Point& point, const points::PointReading& reading);

/// The duration in whole milliseconds, rounded towards zero, for members that end in _ms.
std::int64_t whole_ms(Duration duration);
/// "1F 01 FF"
std::string upper_hex(ByteView bytes, std::string_view separator = " ");

// The data of events, one line of JSON each.

std::string point_event(const bus::StationRef& station, const points::Point& point,
                        const points::PointReading& reading);
std::string line_event(std::string_view line, std::string_view state, std::string_view why);
std::string station_event(std::string_view line, std::string_view station, std::string_view what);
/// Progress of a discovery; `state` is "running" or how it ended.
std::string discovery_event(std::string_view line, std::string_view state, std::size_t asked,
                            std::size_t of, std::size_t found);
/// An empty `station` means a broadcast.
std::string transaction_event(std::string_view line, std::string_view station,
                              std::uint8_t function, std::string_view outcome, Duration took);

}  // namespace panelgate::web
