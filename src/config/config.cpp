#include "panelgate/config/config.hpp"

#include <algorithm>
#include <map>
#include <string_view>

#include "loader.hpp"

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

const Line* find_line(const Config& config, std::string_view name) {
    const auto found = std::ranges::find(config.lines, name, &Line::name);
    return found == config.lines.end() ? nullptr : &*found;
}

const Station* station_named(const Config& config, std::string_view name) {
    for (const Line& line : config.lines)
        for (const Station& station : line.stations)
            if (station.name == name) return &station;
    return nullptr;
}

const points::Point* point_named(const Config& config, std::string_view station,
                                 std::string_view point) {
    const Station* const owner = station_named(config, station);
    if (owner == nullptr) return nullptr;
    const auto found = std::ranges::find(owner->points, point, &points::Point::name);
    return found == owner->points.end() ? nullptr : &*found;
}

}  // namespace panelgate::config
