#include <boost/json/object.hpp>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "handlers.hpp"
#include "panelgate/bus/line_history.hpp"
#include "panelgate/points/station_history.hpp"
#include "station_path.hpp"
#include "table_answer.hpp"

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

/// `describe_one` makes an object of a sample.
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
    const auto found = find_point(*api->directory, request.arguments[0], request.arguments[1]);
    if (!found) co_return to_response(found.error());
    const points::StationHistory* history = found->station.history;
    const points::Point& point = *found->point;
    if (history == nullptr || !points::StationHistory::keeps(point))
        co_return to_response(
            problem(404, "no history is kept of '" + point.name + "'; texts have none"));
    const WallClock wall = wall_of(*api);
    Table table = table_of(history->samples(point, wall.now), kPointColumns,
                           [&point, wall](const points::HistorySample& sample) {
                               return describe(sample, point, wall);
                           });
    table.members["station"] = found->station.name;
    table.members["point"] = point.name;
    table.members["unit"] = point.unit;
    table.members["every_ms"] = whole_ms(history->width());
    Handling telling = table_answer(std::move(request), std::move(table));
    co_return co_await std::move(telling);
}

Handling get_line_history(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const bus::LineHistory* history = (*line)->history;
    if (history == nullptr)
        co_return to_response(problem(404, "no history is kept of '" + (*line)->name + '\''));
    const WallClock wall = wall_of(*api);
    Table table =
        table_of(history->samples(wall.now), kLineColumns,
                 [wall](const bus::LineSample& sample) { return describe(sample, wall); });
    table.members["line"] = (*line)->name;
    table.members["every_ms"] = whole_ms(history->width());
    Handling telling = table_answer(std::move(request), std::move(table));
    co_return co_await std::move(telling);
}

}  // namespace panelgate::web
