#include <boost/json/array.hpp>

#include "answer.hpp"
#include "handlers.hpp"
#include "long_answer.hpp"
#include "panelgate/points/station_points.hpp"
#include "station_path.hpp"

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

json::object describe(const StationEntry& station) {
    const bus::StationStatus status = station.bus->station_status(station.id);
    json::object object;
    object["name"] = station.name;
    object["line"] = station.line;
    object["id"] = station.id;
    object["profile"] = nullptr;
    if (!station.unknown_panel) object["profile"] = station.profile->name;
    object["unit"] = nullptr;
    if (station.unit) object["unit"] = *station.unit;
    object["state"] = label(status.state);
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

}  // namespace

Handling get_stations(HttpRequest request, const Api* api) {
    LongAnswer body;
    body.begin_list("stations");
    for (std::size_t i = 0; i < api->directory->stations.size(); ++i) {
        body.add(describe(api->directory->stations[i]));
        if (!body.is_turn_over()) continue;
        boost::asio::awaitable<void> turn = others_turn();
        co_await std::move(turn);
        if (request.caller->has_left()) co_return HttpResponse{};
    }
    body.end_list();
    co_return body.response();
}

Handling get_station(HttpRequest request, const Api* api) {
    const auto station = find_station(*api->directory, request.arguments[0]);
    if (!station) co_return to_response(station.error());
    json::object body = describe(*station);
    body["polls"] = describe_polls(station->points, api->providers.now());
    co_return json_response(200, body);
}

}  // namespace panelgate::web
