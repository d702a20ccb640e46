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

// The columns behind `writable` make the text a `points_file`.
constexpr std::string_view kColumns[] = {
    "name", "value",    "label",  "unit",     "quality",    "age_ms", "at",
    "type", "writable", "bit",    "length",   "word_order", "scale",  "offset",
    "min",  "max",      "labels", "no_value", "every",      "report", "overview"};
constexpr std::string_view kColumnsOfAll[] = {
    "line", "station", "name",     "value",    "label",  "unit",       "quality", "age_ms",
    "at",   "type",    "writable", "bit",      "length", "word_order", "scale",   "offset",
    "min",  "max",     "labels",   "no_value", "every",  "report",     "overview"};

std::string ms_text(Duration duration) { return std::to_string(whole_ms(duration)) + "ms"; }

/// Lists and maps as the configuration has them.
std::string labels_text(const Point& point) {
    std::string text;
    for (const auto& [raw, label] : point.labels)
        text += (text.empty() ? "{" : ", ") + std::to_string(raw) + ": " +
                json_text(json::value(label));
    return text.empty() ? text : text + '}';
}

std::string report_text(const points::ReportRule& rule) {
    std::string text;
    const auto add = [&](const std::string& part) { text += (text.empty() ? "{" : ", ") + part; };
    if (rule.deadband) add("deadband: " + number_text(*rule.deadband));
    if (rule.at_most) add("at_most: " + ms_text(*rule.at_most));
    if (rule.at_least) add("at_least: " + ms_text(*rule.at_least));
    return text.empty() ? text : text + '}';
}

/// What a `points_file` has besides the members of a point.
void add_keys(json::object& object, const Point& point) {
    if (point.bit) object["bit"] = *point.bit;
    if (point.length > 0) object["length"] = point.length;
    if (point.word_order != points::WordOrder::abcd) object["word_order"] = label(point.word_order);
    if (point.scale != 1) object["scale"] = point.scale;
    if (point.offset != 0) object["offset"] = point.offset;
    if (!point.labels.empty()) object["labels"] = labels_text(point);
    std::string raws;
    for (const std::int64_t raw : point.no_value)
        raws += (raws.empty() ? "[" : ", ") + std::to_string(raw);
    if (!raws.empty()) object["no_value"] = raws + ']';
    object["every"] = ms_text(point.every);
    if (!point.report.empty()) object["report"] = report_text(point.report);
    if (point.overview) object["overview"] = true;
}

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

struct Instant {
    TimePoint steady;
    WallTime wall;
};

/// `items`: shown as "raw"; null: not wanted.
json::object describe(const Instant& now, const Point& point, const points::PointReading& reading,
                      const std::vector<std::uint16_t>* items) {
    json::object object = point_json(point, reading);
    object["time"] = nullptr;
    if (reading.age)
        object["time"] = rfc3339(wall_time_of(now.steady - *reading.age, now.steady, now.wall));
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
    const Instant now{api.providers.now(), api.providers.wall()};
    return describe(now, point, station.read(point, now.steady),
                    raw ? &station.items(point) : nullptr);
}

/// A point of a station with a copy of what was read.
struct Seen {
    const StationEntry* station;
    const Point* point;
    points::PointReading reading;
    std::vector<std::uint16_t> items{};
};

void add_points(std::vector<Seen>& seen, const StationEntry& station, const Sight& sight,
                TimePoint now, bool raw) {
    if (station.points == nullptr) return;
    for (const Point& point : station.points->points()) {
        if (!sight.point(station, point)) continue;
        seen.push_back({&station, &point, station.points->read(point, now)});
        if (raw) seen.back().items = station.points->items(point);
    }
}

}  // namespace

Handling get_points(HttpRequest request, const Api* api) {
    const auto station = find_station(*api->directory, request.arguments[0]).value();
    const auto raw = query_flag(request, "raw").value();
    if (raw && wants_csv(request.headers["accept"]))
        co_return to_response(problem(400, "raw is for JSON, not for text/csv"));
    const Instant now{api->providers.now(), api->providers.wall()};
    std::vector<Seen> seen;
    add_points(seen, station, Sight(*api->directory, request.caller->who()), now.steady, raw);
    Table table{.directory = api->lent, .name = "points", .columns = kColumns};
    table.count = seen.size();
    table.entry = [now, seen = std::move(seen), with_raw = raw,
                   as_csv = wants_csv(request.headers["accept"])](std::size_t i) {
        json::object object =
            describe(now, *seen[i].point, seen[i].reading, with_raw ? &seen[i].items : nullptr);
        if (as_csv) add_keys(object, *seen[i].point);
        return object;
    };
    co_return table_answer(request, std::move(table));
}

Handling get_all_points(HttpRequest request, const Api* api) {
    const Instant now{api->providers.now(), api->providers.wall()};
    const Sight sight(*api->directory, request.caller->who());
    std::vector<Seen> seen;
    for (const StationEntry& station : api->directory->stations)
        add_points(seen, station, sight, now.steady, false);
    Table table{.directory = api->lent, .name = "points", .columns = kColumnsOfAll};
    table.count = seen.size();
    table.entry = [now, seen = std::move(seen),
                   as_csv = wants_csv(request.headers["accept"])](std::size_t i) {
        const Seen& one = seen[i];
        json::object object;
        object["line"] = one.station->line;
        object["station"] = one.station->name;
        for (const auto& [name, value] : describe(now, *one.point, one.reading, nullptr))
            object[name] = value;
        if (as_csv) add_keys(object, *one.point);
        return object;
    };
    co_return table_answer(request, std::move(table));
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
                200, describe({api->providers.now(), api->providers.wall()}, point,
                              point_reading(point, *reading), raw ? &reading->items : nullptr));
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
