#include <boost/json/array.hpp>

#include "answer.hpp"
#include "ask.hpp"
#include "body.hpp"
#include "handlers.hpp"
#include "long_answer.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/points/station_points.hpp"
#include "point_json.hpp"
#include "refusal.hpp"
#include "station_path.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

using points::Point;

json::object describe(const Api& api, const points::StationPoints& station, const Point& point) {
    json::object object = point_json(point, station.read(point, api.providers.now()));
    object["at"] = point.at;
    object["type"] = label(point.type);
    object["writable"] = point.writable;
    return object;
}

struct Found {
    StationEntry station;
    const Point* point = nullptr;
};

Parsed<Found> find_point(const HttpRequest& request, const Directory& directory) {
    auto station = find_station(directory, request.arguments[0]);
    if (!station) return station.error();
    const Point* point =
        station->points != nullptr ? station->points->find(request.arguments[1]) : nullptr;
    if (point == nullptr) {
        return problem(
            404, "station '" + station->name + "' has no point '" + request.arguments[1] + '\'');
    }
    return Found{std::move(*station), point};
}

/// The query `round`: true or false, the default.
Parsed<points::Rounding> rounding_of(const HttpRequest& request) {
    const auto given = request.query.find("round");
    if (given == request.query.end() || given->second == "false") return points::Rounding::exact;
    if (given->second == "true") return points::Rounding::nearest;
    return problem(400, "round is true or false, not '" + given->second + '\'');
}

Parsed<points::PointWrite> write_of(const Found& found, const HttpRequest& request) {
    const auto rounding = rounding_of(request);
    if (!rounding) return rounding.error();
    const auto value = value_of(request.body);
    if (!value) return value.error();
    auto write = points::write_request(*found.station.profile, *found.point, *value, *rounding);
    if (write) return std::move(*write);
    if (write.error().malformed) return problem(400, write.error().message);
    const char* const hint = write.error().inexact ? "; ?round=true writes the nearest" : "";
    return problem(422, write.error().message + hint);
}

/// Confirmed: and what the point is now, which its next read will show.
HttpResponse write_answer(const points::PointWrite& write) {
    json::object body;
    body["transmitted"] = true;
    body["confirmed"] = true;
    body["value"] = json_of(write.value);
    if (write.label) body["label"] = *write.label;
    return json_response(200, body);
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
    LongAnswer body;
    body.begin_list("points");
    const std::size_t count = station->points == nullptr ? 0 : station->points->points().size();
    for (std::size_t i = 0; i < count; ++i) {
        body.add(describe(*api, *station->points, station->points->points()[i]));
        if (!body.is_turn_over()) continue;
        boost::asio::awaitable<void> turn = others_turn();
        co_await std::move(turn);
        if (request.caller->has_left()) co_return HttpResponse{};
    }
    body.end_list();
    co_return body.response();
}

Handling get_point(HttpRequest request, const Api* api) {
    const auto found = find_point(request, *api->directory);
    if (!found) co_return to_response(found.error());
    co_return json_response(200, describe(*api, *found->station.points, *found->point));
}

Handling put_point(HttpRequest request, const Api* api) {
    const auto found = find_point(request, *api->directory);
    if (!found) co_return to_response(found.error());
    const auto write =
        unless_refused(write_of(*found, request), *found->station.bus, found->station.id);
    if (!write) co_return to_response(write.error());
    auto planned = request_to(found->station.id, write->pdu);
    if (!planned) co_return to_response(planned.error());
    bus::Request made = std::move(*planned);
    bus::Answer answer = co_await ask(request.caller, found->station.bus, std::move(made));
    const auto failed = problem_of(answer, *found->station.profile);
    if (failed) co_return to_response(*failed);
    co_return write_answer(*write);
}

Handling get_interpretations(HttpRequest request, const Api* api) {
    auto items = items_of_table_path(request, *api->directory);
    if (!items) co_return to_response(items.error());
    constexpr unsigned kMost = 16;  // registers: a look at one value, not a memory dump
    if (modbus::is_bit_table(items->span.table) || items->span.count > kMost)
        co_return to_response(problem(422, "interpretations are of 1 to 16 registers"));
    bus::Request made{.station = items->station.id, .request = modbus::Request::read(items->span)};
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

Handling get_relays(HttpRequest, const Api* api) {
    json::array list;
    const TimePoint now = api->providers.now();
    for (const points::RelayStatus& relay : api->providers.relays()) {
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
