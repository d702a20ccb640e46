#include "target.hpp"

#include <algorithm>

#include "panelgate/base/text.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/web/api/render.hpp"

namespace panelgate::web {

namespace json = boost::json;
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

Parsed<Target> find_point(const Directory& directory, const std::string& name,
                          const std::string& point_name) {
    auto station = find_station(directory, name);
    if (!station) return station.error();
    const points::Point* point =
        station->points != nullptr ? station->points->find(point_name) : nullptr;
    if (point == nullptr)
        return problem(404, "station '" + station->name + "' has no point '" + point_name + '\'',
                       "unknown-point");
    return Target{.station = std::move(*station),
                  .span = {point->table, point->address, point->count()},
                  .point = point};
}

Parsed<Target> find_point(const Directory& directory, const std::string& name) {
    const auto slash = name.rfind('/');
    if (slash == name.npos)
        return problem(400, "a point is named STATION/POINT, not '" + name + '\'');
    return find_point(directory, name.substr(0, slash), name.substr(slash + 1));
}

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

namespace {

/// Parses an address, decimal or 0x hex, 0..65535.
Parsed<std::uint16_t> parse_address(std::string_view text) {
    const bool is_hex = text.starts_with("0x") || text.starts_with("0X");
    const auto number = is_hex ? to_number(text.substr(2), 16) : to_number(text);
    if (number && *number <= 0xFFFF) return static_cast<std::uint16_t>(*number);
    return problem(
        400, "'" + std::string(text) + "' is not an address: 0 to 65535, or 0x0000 to 0xFFFF");
}

Parsed<Target> notation_target(const Directory& directory, const std::string& name,
                               std::string_view notation) {
    auto station = find_station(directory, name);
    if (!station) return station.error();
    if (station->unknown_panel)
        return problem(422, "station '" + station->name +
                                "' has no profile that explains notations; read its tables");
    const auto item = profile::parse_notation(*station->profile, notation);
    if (!item) {
        const bool outside = item.error().kind == profile::NotationError::Kind::out_of_range;
        return problem(outside ? 422 : 404, item.error().message,
                       outside ? "unprocessable" : "unknown-notation");
    }
    return Target{.station = std::move(*station),
                  .span = {item->area->table, item->address, 1},
                  .area = item->area};
}

/// Sets the count from the query `count`.
Parsed<Target> counted(const HttpRequest& request, Parsed<Target> target) {
    if (!target) return target;
    const unsigned most = modbus::kTableItems - target->span.first;
    const auto count = query_number(request, "count", 1, most, 1);
    if (!count) return count.error();
    target->span.count = *count;
    return target;
}

}  // namespace

Parsed<Target> table_target(const HttpRequest& request, const Directory& directory) {
    auto station = find_station(directory, request.arguments[0]);
    if (!station) return station.error();
    const auto table = parse_table(request.arguments[1], 404);
    if (!table) return table.error();
    const auto address = parse_address(request.arguments[2]);
    if (!address) return address.error();
    return counted(request, Target{.station = std::move(*station), .span = {*table, *address, 1}});
}

Parsed<Target> device_target(const HttpRequest& request, const Directory& directory) {
    return counted(request, notation_target(directory, request.arguments[0], request.arguments[1]));
}

Parsed<std::vector<json::object>> entries_of(std::string_view text, std::size_t most) {
    const auto body = parse_object(text, {"items"});
    if (!body) return body.error();
    const json::value* items = body->if_contains("items");
    if (items == nullptr || !items->is_array() || items->get_array().empty())
        return problem(400, R"(the body must be {"items": [...]} with at least one entry)");
    if (items->get_array().size() > most)
        return problem(422, "at most " + std::to_string(most) + " entries in one list", "too-many");
    std::vector<json::object> entries;
    for (const json::value& item : items->get_array()) {
        if (!item.is_object())
            return problem(
                400, "items[" + std::to_string(entries.size()) + "]: an entry is a JSON object");
        entries.push_back(item.get_object());
    }
    return entries;
}

namespace {

Parsed<void> check_members(const json::object& entry, Members naming, Members others) {
    std::vector<std::string_view> known = naming;
    known.insert(known.end(), others);
    for (const auto& [name, value] : entry) {
        if (std::ranges::find(known, std::string_view(name)) == known.end())
            return unknown_name("member", name, known);
    }
    return {};
}

Parsed<Target> item_target(const json::object& entry, const Directory& directory) {
    const auto name = string_member(entry, "station");
    if (!name) return name.error();
    if (entry.contains("device")) {
        const auto notation = string_member(entry, "device");
        if (!notation) return notation.error();
        return notation_target(directory, *name, *notation);
    }
    const auto word = string_member(entry, "table");
    if (!word) return word.error();
    const auto table = parse_table(*word, 400);
    if (!table) return table.error();
    const auto address = number_member(entry, "address", 0, 0xFFFF);
    if (!address) return address.error();
    auto station = find_station(directory, *name);
    if (!station) return station.error();
    return Target{.station = std::move(*station),
                  .span = {*table, static_cast<std::uint32_t>(*address), 1}};
}

}  // namespace

Parsed<Target> entry_target(const json::object& entry, const Directory& directory,
                            Members of_points, Members of_items) {
    const bool names_point = entry.contains("point");
    const bool names_device = entry.contains("device");
    if (!names_point && !names_device && !entry.contains("table"))
        return problem(400, R"(an entry has "point", "device" or "table")");
    const auto known = names_point ? check_members(entry, {"id", "point"}, of_points)
                       : names_device
                           ? check_members(entry, {"id", "station", "device"}, of_items)
                           : check_members(entry, {"id", "station", "table", "address"}, of_items);
    if (!known) return known.error();
    if (!names_point) return item_target(entry, directory);
    const auto name = string_member(entry, "point");
    if (!name) return name.error();
    return find_point(directory, *name);
}

namespace {

/// Returns 422, with the bounds of the range, for items outside a range of their area.
Parsed<void> check_range(const Target& target, std::size_t count,
                         const profile::AddressRange& range, std::string_view what) {
    if (range.contains(target.span.first, static_cast<std::uint32_t>(count))) return {};
    const auto text = [&](std::uint32_t address) {
        return profile::format_notation(*target.area, static_cast<std::uint16_t>(address));
    };
    return ruled_out(bus::Rule::range, std::to_string(count) + " from " + target.area->name +
                                           " address " + std::to_string(target.span.first) +
                                           " is outside what is " + std::string(what) + ": " +
                                           text(range.first) + " to " + text(range.last));
}

/// A notation names memory, which is read through the first table that the panel can read it with.
Parsed<modbus::Table> table_to_read(const Target& target) {
    const profile::PanelProfile& panel = *target.station.profile;
    const auto is_read = [&](modbus::Table table) {
        return panel.has_function(read_function(table));
    };
    if (target.area == nullptr || is_read(target.span.table)) return target.span.table;
    const auto other = std::ranges::find_if(target.area->also, is_read);
    if (other != target.area->also.end()) return *other;
    return ruled_out(bus::Rule::function,
                     "the panel has no function that reads " + target.area->name);
}

}  // namespace

Parsed<void> make_readable(Target& target, unsigned items, unsigned most) {
    target.span.count = items;
    if (target.area != nullptr) {
        const auto range = check_range(target, items, target.area->readable, "readable");
        if (!range) return range.error();
    }
    if (target.span.end() > modbus::kTableItems)
        return problem(400, std::to_string(items) + " items from " +
                                std::to_string(target.span.first) + " go beyond address 65535");
    const auto table = table_to_read(target);
    if (!table) return table.error();
    target.span.table = *table;
    const unsigned limit = target.station.profile->max_count(read_function(*table)) * most;
    if (items > limit)
        return problem(422, "at most " + std::to_string(limit) + " at once", "too-many");
    return {};
}

Parsed<Target> made_writable(Parsed<Target> target) {
    if (!target || target->area == nullptr) return target;
    const auto& also = target->area->also;
    const auto writable = std::ranges::find_if(also, is_writable);
    if (!is_writable(target->span.table) && writable != also.end()) target->span.table = *writable;
    if (is_writable(target->span.table) && !target->area->writable)
        return ruled_out(bus::Rule::write_protected,
                         target->area->name + " is read-only in this panel");
    return target;
}

Parsed<void> check_written(const Target& target, std::size_t count) {
    if (count > modbus::kTableItems - target.span.first)
        return problem(422, "these values go beyond address 65535");
    if (target.area == nullptr) return {};
    return check_range(target, count, *target.area->writable, "writable");
}

}  // namespace panelgate::web
