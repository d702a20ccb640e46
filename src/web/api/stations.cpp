#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "body.hpp"
#include "key_book.hpp"
#include "panelgate/bus/line_history.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/points/station_points.hpp"
#include "reading.hpp"
#include "routes.hpp"
#include "sight.hpp"
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

}  // namespace

Handling get_stations(HttpRequest request, const Api* api) {
    const Sight sight(*api->directory, request.caller->who());
    LongAnswer body;
    body.begin_list("stations");
    for (std::size_t i = 0; i < api->directory->stations.size(); ++i) {
        const StationEntry& station = api->directory->stations[i];
        if (sight.station(station)) body.add(describe(station));
        if (!body.is_turn_over()) continue;
        boost::asio::awaitable<void> turn = yield_turn();
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
    Handling answering = table_answer(std::move(request), std::move(table));
    co_return co_await std::move(answering);
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
    Handling answering = table_answer(std::move(request), std::move(table));
    co_return co_await std::move(answering);
}

namespace {

Parsed<void> check_raw_station(const Directory& directory, const LineEntry& line, std::uint8_t id,
                               bool may) {
    if (id == 0) return check_may_write(*line.bus, 0);
    const std::string name = line.name + ":" + std::to_string(id);
    const auto station = directory.find_station(name);
    if (!station) return problem(404, "there is no station '" + name + "'", "unknown-station");
    if (may) return {};
    return check_may_write(*line.bus, id);
}

/// No station answers a broadcast, so a broadcast can only write.
Problem no_broadcast() {
    Problem made = problem_of(Fault::denied, false);
    made.detail =
        "refused here, nothing was sent: station 0 is all stations of the line, of which none "
        "answers: a broadcast can write (05, 06, 15, 16), but not read";
    return made;
}

Parsed<bus::Request> raw_request(const Directory& directory, const LineEntry& line,
                                 const json::object& body) {
    const auto station = number_member(body, "station", 0, modbus::kMaxListedStation);
    if (!station) return station.error();
    const auto hex = string_member(body, "pdu");
    if (!hex) return hex.error();
    auto pdu = from_hex(*hex);
    if (!pdu || pdu->empty() || pdu->size() > modbus::kMaxPdu) {
        return problem(400, "pdu must be 1 to 253 bytes as pairs of hex digits");
    }
    const auto id = static_cast<std::uint8_t>(*station);
    const bool reads = modbus::is_pure_read(*pdu);  // also if it is malformed
    const bool spreads = modbus::is_broadcastable(pdu->front());
    auto made = request_to(id, std::move(*pdu));
    if (id == 0 && !spreads && (made || reads)) return no_broadcast();
    const auto allowed = check_raw_station(directory, line, id, reads || made);
    if (!allowed) return allowed.error();
    return made;
}

/// Reports a request that is invalid or refused before the bus is asked: the bus counts and logs
/// it.
void count_refused(Caller& caller, bus::RequestPort& bus, const json::object& body) {
    const auto station = number_member(body, "station", 0, modbus::kMaxListedStation);
    const auto hex = string_member(body, "pdu");
    const auto pdu = hex ? from_hex(*hex) : std::nullopt;
    if (!station || !pdu || pdu->empty() || pdu->size() > modbus::kMaxPdu) return;
    introduce(caller, &bus);
    bus.count_refused(static_cast<std::uint8_t>(*station), *pdu, caller.who());
}

/// A panel's exception reply is a normal answer here.
HttpResponse raw_answer(const bus::Answer& answer) {
    if (answer.refusal || !answer.pdu) return to_response(problem_of(answer));
    json::object body;
    body["pdu"] = upper_hex(*answer.pdu, "");
    if (const auto code = modbus::exception_of(*answer.pdu)) body["exception"] = *code;
    return json_response(200, body);
}

}  // namespace

Handling post_raw(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const auto body = parse_object(request.body, {"station", "pdu"});
    if (!body) co_return to_response(body.error());
    auto planned = raw_request(*api->directory, **line, *body);
    if (!planned) {
        count_refused(*request.caller, *(*line)->bus, *body);
        co_return to_response(planned.error());
    }
    bus::Request made = std::move(*planned);
    const bool broadcast = made.station == 0;
    const Patience patience((*line)->deadline, api->providers.now);
    made.within = patience.left();
    made.raw = made.verbatim = true;
    bus::Answer answer = co_await ask(request.caller, (*line)->bus, std::move(made));
    co_return broadcast ? broadcast_answer(answer) : raw_answer(answer);
}

}  // namespace panelgate::web
