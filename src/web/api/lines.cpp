#include <boost/json/array.hpp>
#include <cmath>
#include <string>

#include "answer.hpp"
#include "handlers.hpp"
#include "long_answer.hpp"
#include "station_path.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

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
        object["name"] = nullptr;
        if (!finding.name.empty()) object["name"] = finding.name;
        object["text"] = finding.text;
        object["advice"] = finding.advice;
        object["evidence"] = finding.evidence;
        json::object figures;
        for (const auto& [name, value] : finding.figures) figures[name] = value;
        object["figures"] = std::move(figures);
        list.push_back(std::move(object));
    }
    return list;
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
        object["gone_ms"] = nullptr;
        if (client.gone) object["gone_ms"] = whole_ms(*client.gone);
        object["busy_seconds"] = to_seconds(client.busy);
        object["percent"] = std::round(client.percent * 10) / 10;
        object["transactions"] = client.transactions;
        list.push_back(std::move(object));
    }
    return list;
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

}  // namespace panelgate::web
