#include <algorithm>

#include "answer.hpp"
#include "exchange.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/judge.hpp"
#include "panelgate/web/api/render.hpp"
#include "routes.hpp"
#include "target.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

Handling read_items(HttpRequest request, Target target, const Api* api) {
    auto format = format_of(request).value();
    format.count = target.span.count;
    const auto view = view_of(format, target.span.table).value();
    make_readable(target, view.items, api->providers.settings.max_transactions).value();
    const Patience patience(api->directory->line_of(target.station).deadline, api->providers.now);
    boost::asio::awaitable<Parsed<Reading>> reads =
        read_all(request.caller, &target.station, target.span, patience);
    const Parsed<Reading> reading = co_await std::move(reads);
    if (!reading) co_return to_response(reading.error());
    co_return json_response(200, describe(target, view, *reading));
}

/// Logs and answers a refusal; the log names the target as the path does: "press/points/setpoint".
HttpResponse refused(const HttpRequest& request, const Problem& why) {
    std::string at;
    for (std::size_t i = 3; i < request.path.size(); ++i)  // after /api/v1/stations
        at += (at.empty() ? "" : "/") + request.path[i];
    log_refused(*request.caller, at, why);
    return to_response(why);
}

Handling carry_out(HttpRequest request, Parsed<Writing> writing, const Api* api) {
    if (!writing) co_return refused(request, writing.error());
    const Patience patience(api->directory->line_of(writing->station).deadline, api->providers.now);
    boost::asio::awaitable<Parsed<json::object>> writes =
        write(request.caller, &*writing, patience);
    const Parsed<json::object> result = co_await std::move(writes);
    if (!result) co_return to_response(result.error());
    co_return json_response(200, *result);
}

Handling write_items(HttpRequest request, Parsed<Target> target, const Api* api) {
    if (!target) co_return refused(request, target.error());
    const auto body =
        parse_object(request.body, {"values", "value", "type", "order", "length", "verify"});
    boost::asio::awaitable<HttpResponse> done =
        carry_out(std::move(request), write_of(*target, body), api);
    co_return co_await std::move(done);
}

}  // namespace

Handling get_table(HttpRequest request, const Api* api) {
    auto target = table_target(request, *api->directory).value();
    return read_items(std::move(request), std::move(target), api);
}

Handling get_device(HttpRequest request, const Api* api) {
    auto target = device_target(request, *api->directory).value();
    return read_items(std::move(request), std::move(target), api);
}

Handling put_table(HttpRequest request, const Api* api) {
    auto target = table_target(request, *api->directory);
    return write_items(std::move(request), std::move(target), api);
}

Handling put_device(HttpRequest request, const Api* api) {
    auto target = made_writable(device_target(request, *api->directory));
    return write_items(std::move(request), std::move(target), api);
}

Handling put_point(HttpRequest request, const Api* api) {
    const auto to = find_point(*api->directory, request.arguments[0], request.arguments[1]).value();
    const auto round = query_flag(request, "round");
    Parsed<points::Rounding> rounding = points::Rounding::exact;
    if (!round) rounding = round.error();
    if (round && *round) rounding = points::Rounding::nearest;
    auto writing = write_of(to, parse_object(request.body, {"value", "verify"}), rounding);
    boost::asio::awaitable<HttpResponse> done =
        carry_out(std::move(request), std::move(writing), api);
    co_return co_await std::move(done);
}

Handling get_interpretations(HttpRequest request, const Api* api) {
    const auto target = table_target(request, *api->directory).value();
    constexpr unsigned kMost = 16;  // registers: for one value, not for a memory dump
    if (modbus::is_bit_table(target.span.table) || target.span.count > kMost)
        co_return to_response(problem(422, "interpretations are of 1 to 16 registers"));
    const Patience patience(api->directory->line_of(target.station).deadline, api->providers.now);
    bus::Request made{.station = target.station.id, .request = modbus::Request::read(target.span)};
    bus::Answer answer =
        co_await ask(request.caller, target.station.bus, std::move(made), patience);
    const auto failed = problem_of(answer, *target.station.profile);
    if (failed) co_return to_response(*failed);
    const auto registers = modbus::registers_of(*answer.pdu);
    json::array list;
    for (const points::Interpretation& one : points::interpretations(registers)) {
        json::array values;
        for (const std::string& value : one.values)
            values.push_back(value.empty() ? json::value(nullptr) : json::value(value));
        list.push_back(json::object{{"type", label(one.type)},
                                    {"word_order", label(one.order)},
                                    {"values", std::move(values)}});
    }
    json::object body{{"station", target.station.name}, {"address", target.span.first}};
    body["raw"] = json::array(registers.begin(), registers.end());
    body["interpretations"] = std::move(list);
    co_return json_response(200, body);
}

namespace {

/// The panel's notation of each item; none if the panel type is unknown.
json::array notations(Target target) {
    json::array names;
    if (target.station.unknown_panel) return names;
    const modbus::Span span = target.span;
    const profile::Area* const area = target.area;
    for (unsigned i = 0; i < span.count; ++i) {
        const bool within = area != nullptr && area->readable.contains(span.first + i, 1);
        target.area = within ? area : nullptr;
        names.emplace_back(notation_of(target, i));
    }
    return names;
}

/// The frame as it would be sent, with functions translated that the panel lacks.
std::string frame_of(const StationEntry& station, Bytes pdu) {
    auto request = modbus::Request::make(std::move(pdu), modbus::QuantityCheck::wide);
    if (!request) return "";
    const auto translated = profile::translate(*station.profile, *request);
    const Bytes& sent = translated ? translated->pdu() : request->pdu();
    return upper_hex(modbus::encode_adu(station.id, sent, station.profile->crc_order), " ");
}

HttpResponse plan_of(const Target& target, Bytes pdu, unsigned requests) {
    json::object body;
    body["station"] = target.station.name;
    body["line"] = target.station.line;
    body["id"] = target.station.id;
    body["table"] = label(target.span.table);
    body["address"] = target.span.first;
    body["count"] = target.span.count;
    body["requests"] = requests;
    body["frame"] = frame_of(target.station, std::move(pdu));
    body["notations"] = notations(target);
    return json_response(200, body);
}

/// The plan of a read; if it takes several requests, the first of them.
HttpResponse plan_of_read(Target target) {
    make_readable(target, target.span.count, modbus::kTableItems).value();
    const unsigned limit = target.station.profile->max_count(read_function(target.span.table));
    const unsigned requests = (target.span.count + limit - 1) / limit;
    target.span.count = std::min(target.span.count, limit);
    return plan_of(target, modbus::encode_read(target.span), requests);
}

HttpResponse plan_of_write(Target target, const Parsed<json::object>& body) {
    const Writing writing = write_of(target, body).value();
    const modbus::Request& made = writing.request.request;
    target.span = *made.access().write;
    return plan_of(target, made.pdu(), 1);
}

/// The request that would be sent; nothing is sent.
HttpResponse plan(const HttpRequest& request, Target target) {
    const auto values = request.query.find("values");
    if (values == request.query.end()) return plan_of_read(std::move(target));
    return plan_of_write(made_writable(std::move(target)).value(),
                         parse_object("{\"values\":[" + values->second + "]}", {"values"}));
}

}  // namespace

Handling get_table_plan(HttpRequest request, const Api* api) {
    co_return plan(request, table_target(request, *api->directory).value());
}

Handling get_device_plan(HttpRequest request, const Api* api) {
    co_return plan(request, device_target(request, *api->directory).value());
}

Handling get_point_plan(HttpRequest request, const Api* api) {
    Target target = find_point(*api->directory, request.arguments[0], request.arguments[1]).value();
    const auto value = request.query.find("value");
    if (value == request.query.end()) co_return plan_of_read(std::move(target));
    co_return plan_of_write(std::move(target),
                            parse_object("{\"value\":" + value->second + "}", {"value"}));
}

}  // namespace panelgate::web
