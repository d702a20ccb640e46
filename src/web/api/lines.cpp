#include <boost/json/array.hpp>
#include <cmath>

#include "answer.hpp"
#include "handlers.hpp"
#include "panelgate/web/http/query.hpp"
#include "station_path.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

constexpr unsigned kDefaultTrace = 100;  ///< frames
constexpr unsigned kMaxTrace = 10'000;

/// In the list of lines a finding is only its cause.
json::object describe(const LineEntry& line, const bus::LineStatus& status) {
    json::object object;
    object["name"] = line.name;
    object["device"] = line.device;
    object["state"] = status.state;
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
        object["busy_seconds"] = to_seconds(client.busy);
        object["percent"] = std::round(client.percent * 10) / 10;
        object["transactions"] = client.transactions;
        list.push_back(std::move(object));
    }
    return list;
}

}  // namespace

Handling get_lines(HttpRequest, const Api* api) {
    json::array lines;
    for (const LineEntry& line : api->directory->lines)
        lines.push_back(describe(line, line.bus->status()));
    json::object body;
    body["lines"] = std::move(lines);
    co_return json_response(200, body);
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
    const auto last = query_number(request, "last", 1, kMaxTrace, kDefaultTrace);
    if (!last) co_return to_response(last.error());
    json::array frames;
    for (const bus::TraceFrame& frame : (*line)->bus->trace(*last)) {
        frames.push_back(describe(frame));
    }
    json::object body;
    body["frames"] = std::move(frames);
    json::array decisions;
    for (const bus::TraceDecision& decision : (*line)->bus->decisions(*last)) {
        decisions.push_back(describe(decision));
    }
    body["decisions"] = std::move(decisions);
    co_return json_response(200, body);
}

}  // namespace panelgate::web
