#include "panelgate/web/api/directory.hpp"

#include <algorithm>

#include "panelgate/modbus/function.hpp"
#include "panelgate/web/http/query.hpp"

namespace panelgate::web {
namespace {

std::optional<std::uint8_t> parse_id(std::string_view text) {
    const auto id = to_number(text);
    if (!id || *id < 1 || *id > modbus::kMaxListedStation) return std::nullopt;
    return static_cast<std::uint8_t>(*id);
}

}  // namespace

const LineEntry* Directory::find_line(std::string_view name) const {
    const auto line = std::ranges::find(lines, name, &LineEntry::name);
    return line == lines.end() ? nullptr : &*line;
}

const LineEntry& Directory::line_of(const StationEntry& station) const {
    return *find_line(station.line);
}

std::optional<StationEntry> Directory::find_station(std::string_view name) const {
    const auto named = std::ranges::find(stations, name, &StationEntry::name);
    if (named != stations.end()) return *named;

    const auto colon = name.rfind(':');
    if (colon == std::string_view::npos) return std::nullopt;
    const auto id = parse_id(name.substr(colon + 1));
    if (!id) return std::nullopt;
    for (const StationEntry& station : stations) {
        if (station.line == name.substr(0, colon) && station.id == *id) return station;
    }
    const LineEntry* line = find_line(name.substr(0, colon));
    if (*id > modbus::kMaxStation || line == nullptr || !line->pass_unlisted_stations)
        return std::nullopt;
    StationEntry unlisted;
    unlisted.name = line->name + ":" + std::to_string(*id);
    unlisted.line = line->name;
    unlisted.id = *id;
    unlisted.bus = line->bus;
    unlisted.profile = generic;
    unlisted.unknown_panel = true;
    return unlisted;
}

}  // namespace panelgate::web
