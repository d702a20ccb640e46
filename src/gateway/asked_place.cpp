#include "panelgate/gateway/asked_place.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <cstdint>
#include <vector>

#include "panelgate/base/text.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::gateway {

namespace {

namespace json = boost::json;

std::vector<std::string_view> segments_of(std::string_view path) {
    constexpr std::size_t kMost = 16;
    std::vector<std::string_view> segments;
    while (!path.empty() && segments.size() < kMost) {
        path.remove_prefix(path.front() == '/' ? 1 : 0);
        const std::size_t end = std::min(path.find('/'), path.size());
        segments.push_back(path.substr(0, end));
        path.remove_prefix(end);
    }
    return segments;
}

/// By name, or by LINE:ID.
const Station* station_of(const Plant& plant, std::string_view text) {
    if (const Station* named = plant.find(text)) return named;
    const auto colon = text.rfind(':');
    if (colon == text.npos) return nullptr;
    const auto id = to_number<std::uint8_t>(text.substr(colon + 1));
    return id ? plant.find(text.substr(0, colon), *id) : nullptr;
}

/// "points/speed", "holding-registers/5" or "devices/UW102" of a station.
std::string place_of(const Station& station, std::string_view kind, std::string_view which) {
    const profile::PanelProfile& profile = *station.configured->profile;
    if (kind == "points") {
        const auto& points = station.configured->points;
        const auto point = std::ranges::find(points, which, &points::Point::name);
        if (point == points.end()) return std::string(which);
        return profile::format_notation(profile, point->table, point->address);
    }
    for (const modbus::Table table : modbus::kTables) {
        const auto address = to_number<std::uint16_t>(which);
        if (kind == label(table) && address)
            return profile::format_notation(profile, table, *address);
    }
    return kind == "devices" ? std::string(which) : std::string();
}

const json::object* first_item(const json::object& body) {
    const json::value* items = body.if_contains("items");
    const auto* list = items != nullptr ? items->if_array() : nullptr;
    return list != nullptr && !list->empty() ? list->front().if_object() : nullptr;
}

/// Of several items the first: `{"point": "press/speed"}` or `{"station": "press", ...}`; of raw
/// `{"station": 7}`.
void look_in_body(const Plant& plant, const json::object& body, AskedPlace& place) {
    if (const json::object* item = first_item(body)) return look_in_body(plant, *item, place);
    const std::string point = web::member_text(body, "point");
    const auto slash = point.find('/');
    if (slash != point.npos) {
        place.station = plant.find(point.substr(0, slash));
        if (place.station != nullptr)
            place.at = place_of(*place.station, "points", point.substr(slash + 1));
        return;
    }
    const json::value* station = body.if_contains("station");
    if (station == nullptr) return;
    if (const auto* name = station->if_string()) place.station = station_of(plant, *name);
    const auto* id = station->if_int64();
    if (id != nullptr && *id > 0 && *id < 256)
        place.station = plant.find(place.line, static_cast<std::uint8_t>(*id));
    if (place.station != nullptr) place.at = web::member_text(body, "device");
}

}  // namespace

AskedPlace asked_place(const Plant& plant, std::string_view path, std::string_view body) {
    AskedPlace place;
    const auto segments = segments_of(path);  // api, v1, stations, NAME, ...
    const auto at = [&](std::size_t i) {
        return i < segments.size() ? segments[i] : std::string_view();
    };
    const bool of_line = at(2) == "lines";
    if (of_line) {
        const auto known = std::ranges::find_if(
            plant.lines(), [&](const Line& line) { return line.configured->name == at(3); });
        if (known != plant.lines().end()) place.line = at(3);
    }
    if (at(2) == "stations" || at(2) == "simulator") {
        place.station = station_of(plant, at(3));
        if (place.station != nullptr) place.at = place_of(*place.station, at(4), at(5));
    } else if (place.line.empty() == !of_line) {
        boost::system::error_code wrong;
        const json::value value = json::parse(json::string_view(body.data(), body.size()), wrong);
        if (const auto* object = wrong ? nullptr : value.if_object())
            look_in_body(plant, *object, place);
    }
    if (place.station != nullptr) place.line = place.station->line;
    return place;
}

audit::Members members_of(const AskedPlace& place) {
    audit::Members members;
    audit::add_text(members, "line", place.line);
    if (place.station != nullptr) {
        audit::add_text(members, "station", place.station->name);
        members["id"] = place.station->id;
    }
    audit::add_text(members, "at", place.at);
    return members;
}

}  // namespace panelgate::gateway
