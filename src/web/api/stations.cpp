#include <algorithm>
#include <cmath>

#include "answer.hpp"
#include "panelgate/bus/line_history.hpp"
#include "panelgate/web/api/render.hpp"
#include "panelgate/web/api/values.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "routes.hpp"
#include "sight.hpp"
#include "target.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

json::object describe(const bus::HeardCounts& heard) {
    json::object object;
    object["requests"] = heard.requests;
    object["replies"] = heard.replies;
    object["exceptions"] = heard.exceptions;
    object["timeouts"] = heard.timeouts;
    object["damaged"] = heard.damaged;
    object["doubtful"] = heard.doubtful;
    object["think_ms"] = to_milliseconds(heard.think);
    object["longest_think_ms"] = to_milliseconds(heard.longest_think);
    return object;
}

bus::StationStatus status_of(const StationEntry& station) {
    return station.bus->station_status(station.id);
}

json::object describe(const StationEntry& station, const bus::StationStatus& status) {
    json::object object;
    object["name"] = station.name;
    object["line"] = station.line;
    object["id"] = station.id;
    object["profile"] = nullptr;
    if (!station.unknown_panel) object["profile"] = station.profile->name;
    object["unit"] = nullptr;
    if (station.unit) object["unit"] = *station.unit;
    object["state"] = label(status.state);
    object["condition"] = nullptr;
    if (status.condition) object["condition"] = label(*status.condition);
    object["read_only"] = station.read_only;
    object["last_success_ms"] = nullptr;
    if (status.last_success) {
        object["last_success_ms"] = whole_ms(*status.last_success);
    }
    if (status.heard) object["heard"] = describe(*status.heard);
    return object;
}

json::object describe(const points::StationPoints& points, const points::Poll& block,
                      TimePoint now) {
    const points::Reading& reading = points.reading(block);
    json::object object;
    object["read"] = block.read;
    object["count"] = block.count;
    object["every_ms"] = whole_ms(block.every);
    object["quality"] = label(points::quality_of(reading, block.every, now));
    object["age_ms"] = nullptr;
    if (reading.sampled) object["age_ms"] = whole_ms(now - *reading.sampled);
    object["good"] = reading.good;
    object["failed"] = reading.failed;
    return object;
}

json::array describe_polls(const points::StationPoints* points, TimePoint now) {
    json::array polls;
    if (points == nullptr) return polls;
    for (const points::Poll& block : points->blocks())
        polls.push_back(describe(*points, block, now));
    return polls;
}

constexpr std::size_t kShown = 3;  // points of a tile

/// The points that the station's tile shows: those with `overview`, else the first.
json::array overview_of(const StationEntry& station, const Sight& sight, TimePoint now) {
    json::array shown;
    if (station.points == nullptr) return shown;
    const std::vector<points::Point>& all = station.points->points();
    const bool chosen = std::ranges::any_of(all, &points::Point::overview);
    for (const points::Point& point : all) {
        if (shown.size() == (chosen ? kShown : 1)) break;
        if ((chosen && !point.overview) || !sight.point(station, point)) continue;
        shown.push_back(point_json(point, station.points->read(point, now)));
    }
    return shown;
}

/// A station with a copy of what is known of the station.
struct SeenStation {
    const StationEntry* station;
    bus::StationStatus status;
    std::optional<json::array> overview{};
};

}  // namespace

Handling get_stations(HttpRequest request, const Api* api) {
    const Sight sight(*api->directory, request.caller->who());
    const bool with_points = query_flag(request, "overview").value();
    std::vector<SeenStation> seen;
    for (const StationEntry& station : api->directory->stations) {
        if (!sight.station(station)) continue;
        seen.push_back({&station, status_of(station)});
        if (with_points) seen.back().overview = overview_of(station, sight, api->providers.now());
    }
    Table table{.directory = api->lent, .name = "stations", .count = seen.size()};
    table.entry = [seen = std::move(seen)](std::size_t i) {
        json::object object = describe(*seen[i].station, seen[i].status);
        if (seen[i].overview) object["overview"] = *seen[i].overview;
        return object;
    };
    co_return table_answer(request, std::move(table));
}

Handling get_station(HttpRequest request, const Api* api) {
    const auto station = find_station(*api->directory, request.arguments[0]).value();
    json::object body = describe(station, status_of(station));
    body["polls"] = describe_polls(station.points, api->providers.now());
    co_return json_response(200, body);
}

namespace {

constexpr std::string_view kPointColumns[] = {"time", "value"};
constexpr std::string_view kLineColumns[] = {"time",       "load_percent", "requests",   "errors",
                                             "latency_ms", "wire_ms",      "queue_depth"};

/// Converts instants to wall-clock time.
struct WallClock {
    TimePoint now;
    WallTime shown;

    std::string text(TimePoint at) const { return rfc3339(wall_time_of(at, now, shown)); }
};

/// Two decimals, the precision of the measurement.
json::value rounded(const std::optional<double>& value) {
    if (!value) return nullptr;
    return std::round(*value * 100) / 100;
}

json::object describe(const points::HistorySample& sample, const points::Point& point,
                      const WallClock& wall) {
    json::object object;
    object["time"] = wall.text(sample.at);
    object["value"] = nullptr;
    if (sample.value && point.type == points::Type::boolean) {
        object["value"] = *sample.value != 0;
    } else if (sample.value) {
        object["value"] = *sample.value;
    }
    return object;
}

json::object describe(const bus::LineSample& sample, const WallClock& wall) {
    json::object object;
    object["time"] = wall.text(sample.at);
    object["load_percent"] = rounded(sample.load_percent);
    object["requests"] = sample.requests;
    object["errors"] = sample.errors;
    object["latency_ms"] = rounded(sample.latency_ms);
    object["wire_ms"] = rounded(sample.wire_ms);
    object["queue_depth"] = sample.queue_depth;
    return object;
}

/// `describe_one` returns an object for a sample.
template <class Sample, class Describe>
Table table_of(std::vector<Sample> samples, std::span<const std::string_view> columns,
               Describe describe_one) {
    Table table;
    table.name = "samples";
    table.columns = columns;
    table.count = samples.size();
    table.entry = [samples = std::move(samples), describe_one](std::size_t i) {
        return describe_one(samples[i]);
    };
    return table;
}

WallClock wall_of(const Api& api) { return {api.providers.now(), api.providers.wall()}; }

}  // namespace

Handling get_point_history(HttpRequest request, const Api* api) {
    if (asks_for_days(request)) {
        Handling days = get_days(std::move(request), api);
        co_return co_await std::move(days);
    }
    const auto found =
        find_point(*api->directory, request.arguments[0], request.arguments[1]).value();
    const points::StationHistory* history = found.station.history;
    const points::Point& point = *found.point;
    if (history == nullptr || !points::StationHistory::keeps(point))
        co_return to_response(
            problem(404, "no history is kept of '" + point.name + "'; texts have none"));
    const WallClock wall = wall_of(*api);
    Table table = table_of(history->samples(point, wall.now), kPointColumns,
                           [&point, wall](const points::HistorySample& sample) {
                               return describe(sample, point, wall);
                           });
    table.members["station"] = found.station.name;
    table.members["point"] = point.name;
    table.members["unit"] = point.unit;
    table.members["every_ms"] = whole_ms(history->width());
    table.directory = api->lent;
    co_return table_answer(request, std::move(table));
}

Handling get_line_history(HttpRequest request, const Api* api) {
    const LineEntry* const line = find_line(*api->directory, request.arguments[0]).value();
    const bus::LineHistory* history = line->history;
    if (history == nullptr)
        co_return to_response(problem(404, "no history is kept of '" + line->name + '\''));
    const WallClock wall = wall_of(*api);
    Table table =
        table_of(history->samples(wall.now), kLineColumns,
                 [wall](const bus::LineSample& sample) { return describe(sample, wall); });
    table.members["line"] = line->name;
    table.members["every_ms"] = whole_ms(history->width());
    table.directory = api->lent;
    co_return table_answer(request, std::move(table));
}

namespace {

StationEntry find_simulated(const HttpRequest& request, const Api* api) {
    StationEntry station = find_station(*api->directory, request.arguments[0]).value();
    if (!station.simulated) refuse(404, "station '" + station.name + "' is not simulated");
    return station;
}

/// The body's members as numbers; true is 1 and false is 0.
std::map<std::string, double> numbers_of(const json::object& body) {
    std::map<std::string, double> numbers;
    for (const auto& [key, value] : body) {
        if (!value.is_number() && !value.is_bool())
            refuse(400,
                   "the fault '" + excerpt(std::string(key)) + "' must be a number, true or false");
        numbers[key] = value.is_bool() ? (value.get_bool() ? 1 : 0) : value.to_number<double>();
    }
    return numbers;
}

HttpResponse faults_of(const StationEntry& station) {
    json::object faults;
    for (const auto& [name, value] : station.simulated->faults()) faults[name] = value;
    json::object body;
    body["station"] = station.name;
    body["faults"] = std::move(faults);
    return json_response(200, body);
}

}  // namespace

Handling get_simulated(HttpRequest request, const Api* api) {
    const StationEntry station = find_simulated(request, api);
    co_return faults_of(station);
}

Handling put_simulated(HttpRequest request, const Api* api) {
    const StationEntry station = find_simulated(request, api);
    const auto body = parse_object(request.body).value();
    const auto numbers = numbers_of(body);
    if (const auto wrong = station.simulated->set_faults(numbers))
        co_return to_response(problem(400, *wrong));
    log_client(*request.caller, "simulator faults set",
               {{"station", station.name}, {"faults", json_text(body)}});
    co_return faults_of(station);
}

}  // namespace panelgate::web
