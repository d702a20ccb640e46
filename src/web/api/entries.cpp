#include "entries.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <cstdint>
#include <utility>

namespace panelgate::web {
namespace json = boost::json;
namespace {

bool has(const json::object& entry, std::string_view name) { return entry.contains(name); }

}  // namespace

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
            return in_entry(entries.size(), problem(400, "an entry is a JSON object"));
        entries.push_back(item.get_object());
    }
    return entries;
}

bool names_point(const json::object& entry) { return has(entry, "point"); }

Parsed<void> check_members(const json::object& entry, Members of_points, Members of_items) {
    std::vector<std::string_view> known;
    if (names_point(entry)) {
        known = {"id", "point"};
        known.insert(known.end(), of_points);
    } else {
        if (!has(entry, "device") && !has(entry, "table"))
            return problem(400, R"(an entry has "point", "device" or "table")");
        known = {"id", "station"};
        if (has(entry, "device")) {
            known.emplace_back("device");
        } else {
            known.insert(known.end(), {"table", "address"});
        }
        known.insert(known.end(), of_items);
    }
    for (const auto& [name, value] : entry) {
        if (std::find(known.begin(), known.end(), std::string_view(name)) == known.end())
            return unknown_name("member", name, known);
    }
    return {};
}

Parsed<PointOfStation> point_of(const json::object& entry, const Directory& directory) {
    const auto name = string_member(entry, "point");
    if (!name) return name.error();
    return find_point(directory, *name);
}

Parsed<Items> item_of(const json::object& entry, const Directory& directory) {
    const auto name = string_member(entry, "station");
    if (!name) return name.error();
    if (has(entry, "device")) {
        const auto notation = string_member(entry, "device");
        if (!notation) return notation.error();
        auto station = find_station(directory, *name);
        if (!station) return station.error();
        return item_of_notation(std::move(*station), *notation);
    }
    const auto word = string_member(entry, "table");
    if (!word) return word.error();
    const auto table = parse_table(*word, 400);
    if (!table) return table.error();
    const auto address = number_member(entry, "address", 0, 0xFFFF);
    if (!address) return address.error();
    auto station = find_station(directory, *name);
    if (!station) return station.error();
    return item_of_table(std::move(*station), *table, static_cast<std::uint16_t>(*address));
}

Problem in_entry(std::size_t index, Problem problem) {
    problem.detail = "items[" + std::to_string(index) + "]: " + problem.detail;
    return problem;
}

}  // namespace panelgate::web
