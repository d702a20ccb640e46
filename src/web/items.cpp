#include "items.hpp"

#include <algorithm>
#include <charconv>

#include "panelgate/profile/notation.hpp"

namespace panelgate::web {
namespace {

constexpr modbus::Table kTables[] = {modbus::Table::coils, modbus::Table::discrete_inputs,
                                     modbus::Table::input_registers,
                                     modbus::Table::holding_registers};

std::optional<unsigned> to_number(std::string_view text, int base) {
    unsigned number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

}  // namespace

Parsed<modbus::Table> parse_table(std::string_view word, unsigned status) {
    for (const modbus::Table table : kTables) {
        if (word == label(table)) return table;
    }
    return problem(status, "there is no table '" + std::string(word) +
                               "'; there are coils, discrete-inputs, input-registers and "
                               "holding-registers");
}

Parsed<std::uint16_t> parse_address(std::string_view text) {
    const bool is_hex = text.starts_with("0x") || text.starts_with("0X");
    const auto number = is_hex ? to_number(text.substr(2), 16) : to_number(text, 10);
    if (number && *number <= 0xFFFF) return static_cast<std::uint16_t>(*number);
    return problem(
        400, "'" + std::string(text) + "' is not an address: 0 to 65535, or 0x0000 to 0xFFFF");
}

Parsed<unsigned> query_number(const HttpRequest& request, const std::string& name, unsigned low,
                              unsigned high, unsigned fallback) {
    const auto given = request.query.find(name);
    if (given == request.query.end()) return fallback;
    const auto number = to_number(given->second, 10);
    if (number && *number >= low && *number <= high) return *number;
    return problem(400, name + " must be a whole number from " + std::to_string(low) + " to " +
                            std::to_string(high));
}

Parsed<const LineEntry*> find_line(const Api& api, const std::string& name) {
    const LineEntry* line = api.directory->find_line(name);
    if (line != nullptr) return line;
    return problem(404, "there is no line '" + name + "'");
}

Parsed<StationEntry> find_station(const Api& api, const std::string& name) {
    auto station = api.directory->find_station(name);
    if (station) return std::move(*station);
    return problem(404, "there is no station '" + name + "'");
}

Parsed<Items> items_of_table_path(const HttpRequest& request, const Api& api) {
    Items items;
    auto station = find_station(api, request.arguments[0]);
    if (!station) return station.error();
    items.station = std::move(*station);
    const auto table = parse_table(request.arguments[1], 404);
    if (!table) return table.error();
    items.table = *table;
    const auto address = parse_address(request.arguments[2]);
    if (!address) return address.error();
    items.address = *address;
    const auto count = query_number(request, "count", 1, 0x10000u - items.address, 1);
    if (!count) return count.error();
    items.count = *count;
    return items;
}

Parsed<Items> items_of_device_path(const HttpRequest& request, const Api& api) {
    Items items;
    auto station = find_station(api, request.arguments[0]);
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
    items.table = item->area->table;
    items.address = item->address;
    const auto count = query_number(request, "count", 1, 0x10000u - items.address, 1);
    if (!count) return count.error();
    items.count = *count;
    return items;
}

unsigned max_count(const StationEntry& station, std::uint8_t function) {
    return std::max(1u, station.profile->max_count(function));
}

bool has_function(const StationEntry& station, std::uint8_t function) {
    return station.profile->find_function(function) != nullptr;
}

Parsed<void> check_range(const Items& items, const profile::AddressRange& range,
                         std::string_view what) {
    if (range.contains(items.address, items.count)) return {};
    const auto first =
        profile::format_notation(*items.area, static_cast<std::uint16_t>(range.first));
    const auto last = profile::format_notation(*items.area, static_cast<std::uint16_t>(range.last));
    return problem(422, std::to_string(items.count) + " from " + items.area->name + " address " +
                            std::to_string(items.address) + " is outside what is " +
                            std::string(what) + ": " + first + " to " + last);
}

std::string meaning_of(const profile::PanelProfile& profile, std::uint8_t code) {
    for (const profile::ExceptionMeaning& exception : profile.exceptions) {
        if (exception.code == code) return exception.meaning;
    }
    return {};
}

std::string upper_hex(ByteView bytes, std::string_view separator) {
    std::string text = to_hex(bytes, separator);
    for (char& c : text) c = c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c;
    return text;
}

}  // namespace panelgate::web
