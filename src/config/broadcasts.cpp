#include "panelgate/config/broadcasts.hpp"

#include <algorithm>

namespace panelgate::config {

const Station* forbids_broadcasts(const Config& config, const tcp_server::Settings& listener) {
    if (listener.units.contains(0)) return nullptr;  // one station's alias, or one line's
    for (const Line& line : config.lines) {
        if (std::ranges::count(listener.lines, line.name) == 0) continue;
        const auto found = std::ranges::find_if(line.stations, &Station::read_only);
        if (found != line.stations.end()) return &*found;
    }
    return nullptr;
}

}  // namespace panelgate::config
