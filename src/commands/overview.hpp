#pragma once

#include <boost/json/object.hpp>
#include <string>
#include <vector>

namespace panelgate::commands {

/// What a running gateway tells of itself.
struct Overview {
    std::string url;
    std::vector<boost::json::object> lines;  ///< GET /api/v1/lines/{line} of each
    boost::json::object stations;            ///< GET /api/v1/stations
    boost::json::object relays;              ///< GET /api/v1/relays
    boost::json::object findings;            ///< GET /api/v1/findings
    boost::json::object alarms;              ///< GET /api/v1/alarms
    boost::json::object usage;               ///< GET /api/v1/usage: of the last minute
    std::string not_ready;                   ///< what /readyz says, unless it is 200
};

/// What is not well, a sentence each: lines, stations, findings of lines and of the gateway,
/// alarms, relays, listeners.
std::vector<std::string> troubles(const Overview& overview);
/// Tables of lines and stations, findings with their advice, and what is not well.
std::string status_text(const Overview& overview, bool coloured);
/// The same for programs: one object of JSON with `url`, `ready`, `troubles`, and what REST says of
/// all lines, stations, relays, findings and usage.
std::string status_json(const Overview& overview);
/// Lines with their utilisation, clients by their share, slowest panels: of the last minute.
std::string top_text(const Overview& overview, bool coloured);

}  // namespace panelgate::commands
