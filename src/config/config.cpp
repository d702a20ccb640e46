#include "panelgate/config/config.hpp"

#include <map>
#include <string_view>

namespace panelgate::config {

void share_profiles(Config& next, const Config& running) {
    std::map<std::string_view, profile::ProfileRef> known;
    for (const Line& line : running.lines) {
        for (const Station& station : line.stations)
            known.emplace(station.profile->name, station.profile);
    }
    for (Line& line : next.lines) {
        for (Station& station : line.stations) {
            const auto found = known.find(station.profile->name);
            if (found != known.end() && *found->second == *station.profile)
                station.profile = found->second;
        }
    }
}

}  // namespace panelgate::config
