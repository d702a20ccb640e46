#include "station_path.hpp"

#include <cstdlib>
#include <string>
#include <utility>

#include "panelgate/profile/notation.hpp"
#include "panelgate/web/http/query.hpp"

namespace panelgate::web {

namespace {

/// Sets the count from the query `count`.
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

Parsed<void> check_range(const Items& items, const profile::AddressRange& range,
                         std::string_view what) {
    if (range.contains(items.span.first, items.span.count)) return {};
    const auto first =
        profile::format_notation(*items.area, static_cast<std::uint16_t>(range.first));
    const auto last = profile::format_notation(*items.area, static_cast<std::uint16_t>(range.last));
    return ruled_out(bus::Rule::range,
                     std::to_string(items.span.count) + " from " + items.area->name + " address " +
                         std::to_string(items.span.first) + " is outside what is " +
                         std::string(what) + ": " + first + " to " + last);
}

Parsed<modbus::Table> table_to_read(const Items& items) {
    if (items.area == nullptr ||
        items.station.profile->has_function(read_function(items.span.table))) {
        return items.span.table;
    }
    for (const modbus::Table table : items.area->also) {
        if (items.station.profile->has_function(read_function(table))) return table;
    }
    return ruled_out(bus::Rule::function,
                     "the panel has no function that reads " + items.area->name);
}

namespace {

std::string why_denied(const bus::Refusal& refusal) {
    if (!refusal.lacking.empty())
        return "the role '" + refusal.why + "' does not have the right " +
               std::string(refusal.lacking);
    if (refusal.why == access::kDefaultRule)
        return "no rule of access allows it, and the default is deny";
    return "the rule '" + refusal.why + "' of access denies it";
}

std::string detail_of(const bus::Refusal& refusal) {
    const std::string station = "station '" + refusal.station + "'";
    switch (refusal.rule) {
        case bus::Rule::read_only:
            return station + " is read-only";
        case bus::Rule::broadcast_over_read_only:
            return "a broadcast would write to " + station + ", which is read-only";
        case bus::Rule::listening:
            return "line '" + refusal.why +
                   "' has another master: it is only listened to (mode: listen); its points show "
                   "what passed by";
        case bus::Rule::unrecorded:
            return "a write to " + station +
                   " could not be recorded: the audit's file takes nothing now";
        case bus::Rule::denied:
            return why_denied(refusal);  // who asked by an address is not told a name
        case bus::Rule::function:
        case bus::Rule::quantity:
        case bus::Rule::range:
        case bus::Rule::write_protected:
            return "the guard of " + station + " refuses it" +
                   (refusal.why.empty() ? "" : ": " + refusal.why);
    }
    std::abort();
}

Problem refused(unsigned status, bus::Rule rule, std::string detail) {
    Problem made = problem(status, std::move(detail), "refused");
    made.extensions["rule"] = label(rule);
    made.extensions["transmitted"] = false;
    return made;
}

unsigned status_of(bus::Rule rule) {
    if (rule == bus::Rule::listening) return 409;
    if (rule == bus::Rule::unrecorded) return 503;
    return bus::is_access(rule) ? 403 : 422;
}

}  // namespace

Problem problem_of(const bus::Refusal& refusal) {
    Problem made = refused(status_of(refusal.rule), refusal.rule,
                           "refused here, nothing was sent: " + detail_of(refusal));
    made.extensions["modbus_exception"] = static_cast<std::uint8_t>(refusal.code);
    if (refusal.rule == bus::Rule::denied) made.extensions["rule"] = refusal.why;
    return made;
}

Problem ruled_out(bus::Rule rule, std::string detail) {
    return refused(422, rule, std::move(detail));
}

Parsed<void> check_may_write(const bus::RequestPort& bus, std::uint8_t station) {
    if (const auto refusal = bus.write_refusal(station)) return problem_of(*refusal);
    return {};
}

}  // namespace panelgate::web
