#include "points.hpp"

#include <boost/json/array.hpp>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "answer.hpp"
#include "key_book.hpp"
#include "panelgate/base/decimal.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/web/http/query.hpp"
#include "reading.hpp"
#include "routes.hpp"
#include "sight.hpp"
#include "station_path.hpp"

namespace panelgate::web {

namespace json = boost::json;

namespace {

struct Maker {
    json::value operator()(const auto& value) const { return json::value(value); }
    json::value operator()(const Decimal& value) const { return exact_number(value.text()); }
};

}  // namespace

json::value json_of(const points::Value& value) { return std::visit(Maker(), value); }

json::object point_json(const points::Point& point, const points::PointReading& reading) {
    json::object object;
    object["name"] = point.name;
    object["value"] = nullptr;
    if (reading.value) object["value"] = json_of(*reading.value);
    if (reading.label) object["label"] = *reading.label;
    object["unit"] = point.unit;
    object["quality"] = label(reading.quality);
    object["age_ms"] = nullptr;
    if (reading.age) {
        object["age_ms"] = whole_ms(*reading.age);
    }
    return object;
}

points::PointReading point_reading(const points::Point& point, const Reading& reading) {
    points::PointReading made;
    made.value = points::decode(point, reading.items);
    made.label = points::label_of(point, reading.items);
    made.quality = made.value ? points::Quality::good : points::Quality::bad;
    made.age = reading.age;
    return made;
}

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

json::array describe(const std::vector<points::Interpretation>& all) {
    json::array list;
    for (const points::Interpretation& one : all) {
        json::object object;
        object["type"] = label(one.type);
        object["word_order"] = label(one.order);
        json::array values;
        for (const std::string& value : one.values)
            values.push_back(value.empty() ? json::value(nullptr) : json::value(value));
        object["values"] = std::move(values);
        list.push_back(std::move(object));
    }
    return list;
}

}  // namespace

Handling get_points(HttpRequest request, const Api* api) {
    const auto station = find_station(*api->directory, request.arguments[0]);
    if (!station) co_return to_response(station.error());
    const auto raw = query_flag(request, "raw");
    if (!raw) co_return to_response(raw.error());
    if (*raw && prefers_csv(request.headers["accept"]))
        co_return to_response(problem(400, "raw is for JSON, not for text/csv"));
    const points::StationPoints* const all = station->points;
    const Sight sight(*api->directory, request.caller->who());
    std::vector<const Point*> seen;
    for (const Owned& owned : points_of(*station, sight)) seen.push_back(owned.second);
    Table table;
    table.name = "points";
    table.columns = kColumns;
    table.count = seen.size();
    table.entry = [api, all, seen = std::move(seen), with_raw = *raw](std::size_t i) {
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

namespace {

/// True behind a write: then the panel's own value is asked for, where the line has no other
/// master.
bool may_differ(const PointOfStation& of) {
    return of.station.points->is_outdated(*of.point) && !of.station.bus->status().listens;
}

json::object describe(const Api& api, const Point& point, const Reading& reading, bool raw) {
    return describe(api, api.providers.now(), point, point_reading(point, reading),
                    raw ? &reading.items : nullptr);
}

}  // namespace

Handling get_point(HttpRequest request, const Api* api) {
    const auto found = find_point(*api->directory, request.arguments[0], request.arguments[1]);
    if (!found) co_return to_response(found.error());
    const auto raw = query_flag(request, "raw");
    if (!raw) co_return to_response(raw.error());
    const points::Point& point = *found->point;
    if (may_differ(*found)) {
        const Duration deadline = api->directory->line_of(found->station).deadline;
        const Patience patience(deadline, api->providers.now);
        const modbus::Span span{point.table, point.address, point.count()};
        boost::asio::awaitable<Parsed<Reading>> reads =
            read_all(request.caller, &found->station, span, patience);
        const Parsed<Reading> reading = co_await std::move(reads);
        if (reading) co_return json_response(200, describe(*api, point, *reading, *raw));
    }
    co_return json_response(200, describe(*api, *found->station.points, point, *raw));
}

Handling get_interpretations(HttpRequest request, const Api* api) {
    auto items = items_of_table_path(request, *api->directory);
    if (!items) co_return to_response(items.error());
    constexpr unsigned kMost = 16;  // registers: for one value, not for a memory dump
    if (modbus::is_bit_table(items->span.table) || items->span.count > kMost)
        co_return to_response(problem(422, "interpretations are of 1 to 16 registers"));
    const Duration deadline = api->directory->line_of(items->station).deadline;
    const Patience patience(deadline, api->providers.now);
    bus::Request made{.station = items->station.id, .request = modbus::Request::read(items->span)};
    made.within = patience.left();
    bus::Answer answer = co_await ask(request.caller, items->station.bus, std::move(made));
    const auto failed = problem_of(answer, *items->station.profile);
    if (failed) co_return to_response(*failed);
    const auto registers = modbus::registers_of(*answer.pdu);
    json::object body;
    body["station"] = items->station.name;
    body["address"] = items->span.first;
    body["raw"] = json::array(registers.begin(), registers.end());
    body["interpretations"] = describe(points::interpretations(registers));
    co_return json_response(200, body);
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
        if (relay.last_write) {
            object["last_write_ms"] = whole_ms(now - *relay.last_write);
        }
        list.push_back(std::move(object));
    }
    json::object body;
    body["relays"] = std::move(list);
    co_return json_response(200, body);
}

}  // namespace panelgate::web
