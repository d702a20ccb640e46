#include "service_status.hpp"

#include <algorithm>

#include "panelgate/bus/bus_client.hpp"

namespace panelgate::app {

std::string service_status(const Plant& plant, const std::string& standing,
                           const std::string& missing) {
    const auto& lines = plant.lines();
    const auto up =
        std::ranges::count_if(lines, [](const Line& line) { return line.bus->status().up; });
    std::string text = std::to_string(up) + " of " + std::to_string(lines.size()) +
                       (lines.size() == 1 ? " line up" : " lines up");
    if (!standing.empty()) text += ", listening on " + standing;
    if (!missing.empty()) text += ", waiting to listen on " + missing;
    return text;
}

}  // namespace panelgate::app
