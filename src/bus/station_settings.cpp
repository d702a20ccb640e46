#include "panelgate/bus/station_settings.hpp"

namespace panelgate::bus {

std::string name_of(const Stations& stations, std::uint8_t id) {
    const auto listed = stations.find(id);
    return listed == stations.end() ? std::to_string(id) : listed->second.name;
}

}  // namespace panelgate::bus
