#pragma once

#include <boost/json/object.hpp>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace panelgate::commands {

/// What the metrics say of a station, or of a line with all its stations, since the gateway's
/// start.
struct Figures {
    double requests = 0;
    double errors = 0;        ///< of them, the panel's exceptions included
    double transactions = 0;  ///< on the wire, with an answer
    double seconds = 0;       ///< that those took
};
/// By line and station; a line's own has the station "".
using AllFigures = std::map<std::pair<std::string, std::string>, Figures>;

/// Takes the figures out of a text of /metrics.
AllFigures figures_of(std::string_view metrics);
/// The figures of the time between two texts; those of `now` where `before` has none of a station,
/// or more: the gateway was started anew, or the station was left out for a while.
AllFigures difference(const AllFigures& now, const AllFigures& before);

/// What a running gateway tells of itself.
struct Overview {
    std::string url;
    std::vector<boost::json::object> lines;  ///< GET /api/v1/lines/{line} of each
    boost::json::object stations;            ///< GET /api/v1/stations
    boost::json::object relays;              ///< GET /api/v1/relays
    AllFigures figures;
    std::string not_ready;  ///< what /readyz says, unless it is 200
};

/// What is not well, a sentence each: lines, stations, findings, relays, listeners.
std::vector<std::string> troubles(const Overview& overview);
/// Tables of lines and stations, findings with their advice, and what is not well.
std::string status_text(const Overview& overview, bool coloured);
/// The same for programs: one object of JSON with `url`, `ready`, `troubles`, and what REST says of
/// all lines, stations and relays.
std::string status_json(const Overview& overview);
/// Lines with their utilisation, clients by their share, slowest panels. `seconds` that the figures
/// are of; 0: of all the time.
std::string top_text(const Overview& overview, double seconds, bool coloured);

}  // namespace panelgate::commands
