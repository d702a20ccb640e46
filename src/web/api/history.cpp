#include <boost/json/object.hpp>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "csv.hpp"
#include "handlers.hpp"
#include "long_answer.hpp"
#include "panelgate/bus/line_history.hpp"
#include "panelgate/points/station_history.hpp"
#include "station_path.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

constexpr std::string_view kPointColumns[] = {"time", "value"};
constexpr std::string_view kLineColumns[] = {"time",       "load_percent", "requests",   "errors",
                                             "latency_ms", "wire_ms",      "queue_depth"};

/// Tells instants by the clock on the wall, as it is now.
struct WallClock {
    TimePoint now;
    WallTime shown;

    std::string text(TimePoint at) const { return rfc3339(wall_time_of(at, now, shown)); }
};

/// 2 decimals: what was measured is no better.
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

/// The samples as a table, or behind these members. `object_of` makes an object of a sample.
template <class Sample, class ObjectOf>
Handling tell(HttpRequest request, json::object members, std::vector<Sample> samples,
              std::span<const std::string_view> columns, ObjectOf object_of) {
    const bool as_csv = prefers_csv(request.headers["accept"]);
    LongAnswer body;
    for (const auto& [name, value] : members) body.member(name, value);
    std::string table = csv_line(columns);
    body.begin_list("samples");
    for (const Sample& sample : samples) {
        const json::object one = object_of(sample);
        if (as_csv) {
            table += csv_line(one, columns);
            body.add(nullptr);  // counts turns
        } else {
            body.add(one);
        }
        if (!body.is_turn_over()) continue;
        boost::asio::awaitable<void> turn = others_turn();
        co_await std::move(turn);
        if (request.caller->has_left()) co_return HttpResponse{};
    }
    body.end_list();
    HttpResponse response = as_csv ? csv_response(std::move(table)) : body.response();
    response.headers.emplace_back("Vary", "Accept");
    co_return response;
}

WallClock wall_of(const Api& api) { return {api.providers.now(), api.providers.wall()}; }

}  // namespace

Handling get_point_history(HttpRequest request, const Api* api) {
    const auto found = find_point(*api->directory, request.arguments[0], request.arguments[1]);
    if (!found) co_return to_response(found.error());
    const points::StationHistory* history = found->station.history;
    const points::Point& point = *found->point;
    if (history == nullptr || !points::StationHistory::keeps(point))
        co_return to_response(
            problem(404, "no history is kept of '" + point.name + "'; texts have none"));
    const WallClock wall = wall_of(*api);
    json::object members;
    members["station"] = found->station.name;
    members["point"] = point.name;
    members["unit"] = point.unit;
    members["every_ms"] = whole_ms(history->width());
    const auto as_json = [&point, wall](const points::HistorySample& sample) {
        return describe(sample, point, wall);
    };
    Handling telling = tell(std::move(request), std::move(members),
                            history->samples(point, wall.now), kPointColumns, as_json);
    co_return co_await std::move(telling);
}

Handling get_line_history(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const bus::LineHistory* history = (*line)->history;
    if (history == nullptr)
        co_return to_response(problem(404, "no history is kept of '" + (*line)->name + '\''));
    const WallClock wall = wall_of(*api);
    json::object members;
    members["line"] = (*line)->name;
    members["every_ms"] = whole_ms(history->width());
    const auto as_json = [wall](const bus::LineSample& sample) { return describe(sample, wall); };
    Handling telling = tell(std::move(request), std::move(members), history->samples(wall.now),
                            kLineColumns, as_json);
    co_return co_await std::move(telling);
}

}  // namespace panelgate::web
