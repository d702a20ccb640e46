#include "panelgate/bus/station_settings.hpp"

#include <cstdlib>

namespace panelgate::bus {

std::string_view label(Rule rule) {
    switch (rule) {
        case Rule::read_only:
        case Rule::broadcast_over_read_only:
            return "access";
        case Rule::function:
            return "function";
        case Rule::quantity:
            return "quantity";
        case Rule::range:
            return "range";
        case Rule::listening:
            return "listen";
        case Rule::write_protected:
            return "read-only";
    }
    std::abort();
}

std::optional<modbus::Request> translated(const Stations& stations, std::uint8_t id,
                                          const modbus::Request& request) {
    const auto listed = stations.find(id);
    if (id == 0 || listed == stations.end() || !listed->second.translate) return std::nullopt;
    return listed->second.translate(request);
}

std::string name_of(const Stations& stations, std::uint8_t id) {
    const auto listed = stations.find(id);
    return listed == stations.end() ? std::to_string(id) : listed->second.name;
}

}  // namespace panelgate::bus
