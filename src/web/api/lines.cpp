#include <boost/json/array.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>
#include <system_error>

#include "answer.hpp"
#include "handlers.hpp"
#include "long_answer.hpp"
#include "panelgate/web/http/query.hpp"
#include "station_path.hpp"
#include "trace_page.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

constexpr unsigned kDefaultTrace = 100;  ///< frames
constexpr unsigned kMaxTrace = 500;

/// In the list of lines a finding is only its cause.
json::object describe(const LineEntry& line, const bus::LineStatus& status) {
    json::object object;
    object["name"] = line.name;
    object["device"] = line.device;
    object["state"] = status.state;
    object["mode"] = status.listens ? "listen" : "master";
    object["up"] = status.up;
    object["load_percent"] = std::round(status.load_percent * 10) / 10;
    object["queue_depth"] = status.queue_depth;
    object["echo"] = label(status.echo);
    json::array causes;
    for (const bus::LineFinding& finding : status.findings) causes.emplace_back(finding.cause);
    object["findings"] = std::move(causes);
    return object;
}

json::array describe(const std::vector<bus::LineFinding>& findings) {
    json::array list;
    for (const bus::LineFinding& finding : findings) {
        json::object object;
        object["cause"] = finding.cause;
        object["station"] = nullptr;
        if (finding.station) object["station"] = *finding.station;
        object["text"] = finding.text;
        object["advice"] = finding.advice;
        object["evidence"] = finding.evidence;
        list.push_back(std::move(object));
    }
    return list;
}

json::object describe(const bus::TraceFrame& frame) {
    json::object object;
    object["sequence"] = frame.sequence;
    object["time"] = rfc3339(frame.time);
    object["at"] = to_seconds(frame.at.time_since_epoch());
    object["direction"] = label(direction_of(frame.kind));
    object["station"] = nullptr;
    if (!frame.bytes.empty()) object["station"] = frame.bytes.front();
    object["bytes"] = upper_hex(frame.bytes);
    object["note"] = label(frame.kind);
    if (!frame.why.empty()) object["why"] = frame.why;
    return object;
}

json::object describe(const bus::TraceDecision& decision) {
    json::object object;
    object["sequence"] = decision.sequence;
    object["time"] = rfc3339(decision.time);
    object["at"] = to_seconds(decision.at.time_since_epoch());
    object["text"] = decision.text;
    return object;
}

json::array describe(const std::vector<bus::ClientShare>& clients) {
    json::array list;
    for (const bus::ClientShare& client : clients) {
        json::object object;
        object["name"] = client.name;
        object["address"] = nullptr;
        if (client.address) object["address"] = *client.address;
        object["requests"] = client.requests;
        object["failed"] = client.failed;
        object["last_error"] = nullptr;
        object["last_error_ms"] = nullptr;
        if (client.last_error) {
            object["last_error"] = label(*client.last_error);
            object["last_error_ms"] = whole_ms(client.last_error_ago);
        }
        object["busy_seconds"] = to_seconds(client.busy);
        object["percent"] = std::round(client.percent * 10) / 10;
        object["transactions"] = client.transactions;
        list.push_back(std::move(object));
    }
    return list;
}

/// The page that a query asks for.
Parsed<TracePage> page_of(const HttpRequest& request, const bus::BusClient& bus) {
    const auto since = request.query.find("since");
    const bool follows = since != request.query.end();
    const auto most =
        query_number(request, "last", 1, kMaxTrace, follows ? kMaxTrace : kDefaultTrace);
    if (!most) return most.error();
    if (!follows) return last_of_trace(bus, *most);
    std::uint64_t number = 0;
    const std::string& text = since->second;
    const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (wrong != std::errc() || end != text.data() + text.size())
        return problem(400, "since must be a sequence number: what `next` said, or 0");
    return trace_since(bus, number, *most);
}

}  // namespace

Handling get_lines(HttpRequest request, const Api* api) {
    LongAnswer body;
    body.begin_list("lines");
    for (std::size_t i = 0; i < api->directory->lines.size(); ++i) {
        const LineEntry& line = api->directory->lines[i];
        body.add(describe(line, line.bus->status()));
        if (!body.is_turn_over()) continue;
        boost::asio::awaitable<void> turn = others_turn();
        co_await std::move(turn);
        if (request.caller->has_left()) co_return HttpResponse{};
    }
    body.end_list();
    co_return body.response();
}

Handling get_line(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const bus::LineStatus status = (*line)->bus->status();
    json::object body = describe(**line, status);
    body["findings"] = describe(status.findings);
    body["clients"] = describe((*line)->bus->clients());
    co_return json_response(200, body);
}

Handling get_trace(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const auto page = page_of(request, *(*line)->bus);
    if (!page) co_return to_response(page.error());
    LongAnswer body;
    body.begin_list("frames");
    for (const bus::TraceFrame& frame : page->frames) {
        body.add(describe(frame));
        if (!body.is_turn_over()) continue;
        boost::asio::awaitable<void> turn = others_turn();
        co_await std::move(turn);
    }
    body.end_list().begin_list("decisions");
    for (const bus::TraceDecision& decision : page->decisions) {
        body.add(describe(decision));
        if (!body.is_turn_over()) continue;
        boost::asio::awaitable<void> turn = others_turn();
        co_await std::move(turn);
    }
    body.end_list().member("next", page->next);
    co_return body.response();
}

}  // namespace panelgate::web
