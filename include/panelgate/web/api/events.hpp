#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/points/station_points.hpp"

namespace panelgate::web {

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
