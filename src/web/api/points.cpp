#include <cmath>

#include "answer.hpp"
#include "exchange.hpp"
#include "panelgate/web/api/render.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "routes.hpp"
#include "sight.hpp"
#include "target.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

using points::Point;

constexpr std::string_view kColumns[] = {"name",   "value", "label", "unit",    "quality",
                                         "age_ms", "at",    "type",  "writable"};
constexpr std::string_view kColumnsOfAll[] = {"line",  "station", "name",    "value",
                                              "label", "unit",    "quality", "age_ms",
                                              "at",    "type",    "writable"};

/// Adds what an input form needs, and the poll interval.
void describe_settings(json::object& object, const Point& point) {
    if (point.min) object["min"] = exact_number(point.min->text());
    if (point.max) object["max"] = exact_number(point.max->text());
    if (points::is_integer(point.type)) object["step"] = std::abs(point.scale);
    if (!point.labels.empty()) {
        json::object labels;
        for (const auto& [raw, text] : point.labels) labels[std::to_string(raw)] = text;
        object["labels"] = std::move(labels);
    }
    object["every_ms"] = whole_ms(point.every);
}

/// `items`: shown as "raw"; null: not wanted.
json::object describe(const Api& api, TimePoint now, const Point& point,
                      const points::PointReading& reading,
                      const std::vector<std::uint16_t>* items) {
    json::object object = point_json(point, reading);
    object["time"] = nullptr;
    if (reading.age)
        object["time"] = rfc3339(wall_time_of(now - *reading.age, now, api.providers.wall()));
    if (items != nullptr) {
        object["raw"] = nullptr;
        if (reading.quality != points::Quality::bad)
            object["raw"] = json::array(items->begin(), items->end());
    }
    object["at"] = point.at;
    object["type"] = label(point.type);
    object["writable"] = point.writable;
    describe_settings(object, point);
    return object;
}

json::object describe(const Api& api, const points::StationPoints& station, const Point& point,
                      bool raw) {
    const TimePoint now = api.providers.now();
    return describe(api, now, point, station.read(point, now),
                    raw ? &station.items(point) : nullptr);
}

/// A point and its station.
using Owned = std::pair<const StationEntry*, const Point*>;

std::vector<Owned> points_of(const StationEntry& station, const Sight& sight) {
    std::vector<Owned> seen;
    if (station.points == nullptr) return seen;
    for (const Point& point : station.points->points())
        if (sight.point(station, point)) seen.emplace_back(&station, &point);
    return seen;
}

std::vector<Owned> points_of_all(const Directory& directory, const Sight& sight) {
    std::vector<Owned> all;
    for (const StationEntry& station : directory.stations) {
        const std::vector<Owned> own = points_of(station, sight);
        all.insert(all.end(), own.begin(), own.end());
    }
    return all;
}

}  // namespace

Handling get_points(HttpRequest request, const Api* api) {
    const auto station = find_station(*api->directory, request.arguments[0]).value();
    const auto raw = query_flag(request, "raw").value();
    if (raw && wants_csv(request.headers["accept"]))
        co_return to_response(problem(400, "raw is for JSON, not for text/csv"));
    const points::StationPoints* const all = station.points;
    const Sight sight(*api->directory, request.caller->who());
    std::vector<const Point*> seen;
    for (const Owned& owned : points_of(station, sight)) seen.push_back(owned.second);
    Table table;
    table.name = "points";
    table.columns = kColumns;
    table.count = seen.size();
    table.entry = [api, all, seen = std::move(seen), with_raw = raw](std::size_t i) {
        return describe(*api, *all, *seen[i], with_raw);
    };
    Handling answering = table_answer(std::move(request), std::move(table));
    co_return co_await std::move(answering);
}

Handling get_all_points(HttpRequest request, const Api* api) {
    Table table;
    table.name = "points";
    table.columns = kColumnsOfAll;
    auto all = points_of_all(*api->directory, Sight(*api->directory, request.caller->who()));
    table.count = all.size();
    table.entry = [api, all = std::move(all)](std::size_t i) {
        const auto& [station, point] = all[i];
        json::object object;
        object["line"] = station->line;
        object["station"] = station->name;
        for (const auto& [name, value] : describe(*api, *station->points, *point, false))
            object[name] = value;
        return object;
    };
    Handling answering = table_answer(std::move(request), std::move(table));
    co_return co_await std::move(answering);
}

Handling get_point(HttpRequest request, const Api* api) {
    const auto found =
        find_point(*api->directory, request.arguments[0], request.arguments[1]).value();
    const auto raw = query_flag(request, "raw").value();
    const Point& point = *found.point;
    const StationEntry& station = found.station;
    // Behind a write the panel's own value is asked for, where the line has no other master.
    if (station.points->is_outdated(point) && !station.bus->status().listens) {
        const Patience patience(api->directory->line_of(station).deadline, api->providers.now);
        boost::asio::awaitable<Parsed<Reading>> reads =
            read_all(request.caller, &station, found.span, patience);
        const Parsed<Reading> reading = co_await std::move(reads);
        if (reading)
            co_return json_response(
                200, describe(*api, api->providers.now(), point, point_reading(point, *reading),
                              raw ? &reading->items : nullptr));
    }
    co_return json_response(200, describe(*api, *station.points, point, raw));
}

Handling get_relays(HttpRequest request, const Api* api) {
    json::array list;
    const Sight sight(*api->directory, request.caller->who());
    const TimePoint now = api->providers.now();
    for (const points::RelayStatus& relay : api->providers.relays()) {
        if (!sight.everything()) break;  // it is about two stations
        json::object object;
        object["name"] = relay.name;
        object["state"] = text_of(relay);
        object["reads"] = relay.reads;
        object["writes"] = relay.writes;
        object["repairs"] = relay.repairs;
        object["read_failures"] = relay.read_failures;
        object["write_failures"] = relay.write_failures;
        object["last_write_ms"] = nullptr;
        if (relay.last_write) object["last_write_ms"] = whole_ms(now - *relay.last_write);
        list.push_back(std::move(object));
    }
    co_return json_response(200, json::object{{"relays", std::move(list)}});
}

}  // namespace panelgate::web
