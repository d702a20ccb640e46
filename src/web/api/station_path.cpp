#include "station_path.hpp"

#include <utility>

#include "panelgate/profile/notation.hpp"
#include "panelgate/web/http/query.hpp"

namespace panelgate::web {
namespace {

/// As many as the query `count` says.
Parsed<Items> counted(const HttpRequest& request, Parsed<Items> items) {
    if (!items) return items;
    const unsigned most = modbus::kTableItems - items->span.first;
    const auto count = query_number(request, "count", 1, most, 1);
    if (!count) return count.error();
    items->span.count = *count;
    return items;
}

}  // namespace

Parsed<modbus::Table> parse_table(std::string_view word, unsigned status) {
    for (const modbus::Table table : modbus::kTables) {
        if (word == label(table)) return table;
    }
    return problem(status,
                   "there is no table '" + std::string(word) +
                       "'; there are coils, discrete-inputs, input-registers and "
                       "holding-registers",
                   "unknown-table");
}

Parsed<std::uint16_t> parse_address(std::string_view text) {
    const bool is_hex = text.starts_with("0x") || text.starts_with("0X");
    const auto number = is_hex ? to_number(text.substr(2), 16) : to_number(text);
    if (number && *number <= 0xFFFF) return static_cast<std::uint16_t>(*number);
    return problem(
        400, "'" + std::string(text) + "' is not an address: 0 to 65535, or 0x0000 to 0xFFFF");
}

Parsed<const LineEntry*> find_line(const Directory& directory, const std::string& name) {
    const LineEntry* line = directory.find_line(name);
    if (line != nullptr) return line;
    return problem(404, "there is no line '" + name + "'", "unknown-line");
}

Parsed<StationEntry> find_station(const Directory& directory, const std::string& name) {
    auto station = directory.find_station(name);
    if (station) return std::move(*station);
    return problem(404, "there is no station '" + name + "'", "unknown-station");
}

Parsed<PointOfStation> find_point(const Directory& directory, const std::string& name,
                                  const std::string& point_name) {
    auto station = find_station(directory, name);
    if (!station) return station.error();
    const points::Point* point =
        station->points != nullptr ? station->points->find(point_name) : nullptr;
    if (point == nullptr) {
        return problem(404, "station '" + station->name + "' has no point '" + point_name + '\'',
                       "unknown-point");
    }
    return PointOfStation{std::move(*station), point};
}

Parsed<PointOfStation> find_point(const Directory& directory, const std::string& name) {
    const auto slash = name.rfind('/');
    if (slash == name.npos)
        return problem(400, "a point is named STATION/POINT, not '" + name + '\'');
    return find_point(directory, name.substr(0, slash), name.substr(slash + 1));
}

Parsed<Items> item_of_table(StationEntry station, modbus::Table table, std::uint16_t address) {
    Items items;
    items.station = std::move(station);
    items.span = {table, address, 1};
    return items;
}

Parsed<Items> item_of_notation(StationEntry station, std::string_view notation) {
    if (station.unknown_panel) {
        return problem(422, "station '" + station.name +
                                "' has no profile that explains notations; read its tables");
    }
    const auto item = profile::parse_notation(*station.profile, notation);
    if (!item) {
        const bool outside = item.error().kind == profile::NotationError::Kind::out_of_range;
        return problem(outside ? 422 : 404, item.error().message,
                       outside ? "unprocessable" : "unknown-notation");
    }
    Items items;
    items.station = std::move(station);
    items.area = item->area;
    items.span = {item->area->table, item->address, 1};
    return items;
}

Parsed<Items> items_of_table_path(const HttpRequest& request, const Directory& directory) {
    auto station = find_station(directory, request.arguments[0]);
    if (!station) return station.error();
    const auto table = parse_table(request.arguments[1], 404);
    if (!table) return table.error();
    const auto address = parse_address(request.arguments[2]);
    if (!address) return address.error();
    return counted(request, item_of_table(std::move(*station), *table, *address));
}

Parsed<Items> items_of_device_path(const HttpRequest& request, const Directory& directory) {
    auto station = find_station(directory, request.arguments[0]);
    if (!station) return station.error();
    return counted(request, item_of_notation(std::move(*station), request.arguments[1]));
}

}  // namespace panelgate::web
