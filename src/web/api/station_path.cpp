#include "station_path.hpp"

#include <utility>

#include "panelgate/profile/notation.hpp"
#include "panelgate/web/http/query.hpp"

namespace panelgate::web {

Parsed<modbus::Table> parse_table(std::string_view word, unsigned status) {
    for (const modbus::Table table : modbus::kTables) {
        if (word == label(table)) return table;
    }
    return problem(status, "there is no table '" + std::string(word) +
                               "'; there are coils, discrete-inputs, input-registers and "
                               "holding-registers");
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
    return problem(404, "there is no line '" + name + "'");
}

Parsed<StationEntry> find_station(const Directory& directory, const std::string& name) {
    auto station = directory.find_station(name);
    if (station) return std::move(*station);
    return problem(404, "there is no station '" + name + "'");
}

Parsed<Items> items_of_table_path(const HttpRequest& request, const Directory& directory) {
    Items items;
    auto station = find_station(directory, request.arguments[0]);
    if (!station) return station.error();
    items.station = std::move(*station);
    const auto table = parse_table(request.arguments[1], 404);
    if (!table) return table.error();
    items.span.table = *table;
    const auto address = parse_address(request.arguments[2]);
    if (!address) return address.error();
    items.span.first = *address;
    const auto count = query_number(request, "count", 1, modbus::kTableItems - items.span.first, 1);
    if (!count) return count.error();
    items.span.count = *count;
    return items;
}

Parsed<Items> items_of_device_path(const HttpRequest& request, const Directory& directory) {
    Items items;
    auto station = find_station(directory, request.arguments[0]);
    if (!station) return station.error();
    items.station = std::move(*station);
    if (items.station.unknown_panel) {
        return problem(422, "station '" + items.station.name +
                                "' has no profile that explains notations; read its tables");
    }
    const auto item = profile::parse_notation(*items.station.profile, request.arguments[1]);
    if (!item) {
        const bool outside = item.error().kind == profile::NotationError::Kind::out_of_range;
        return problem(outside ? 422 : 404, item.error().message);
    }
    items.area = item->area;
    items.span.table = item->area->table;
    items.span.first = item->address;
    const auto count = query_number(request, "count", 1, modbus::kTableItems - items.span.first, 1);
    if (!count) return count.error();
    items.span.count = *count;
    return items;
}

}  // namespace panelgate::web
