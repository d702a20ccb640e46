// What is found of the gateway itself, and what was used of its lines in the last minute.
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "answer.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/web/api/sources.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "routes.hpp"
#include "sight.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

double tenths(double value) { return std::round(value * 10) / 10; }

json::array describe(const std::vector<bus::HostUse>& hosts) {
    json::array list;
    for (const bus::HostUse& host : hosts) {
        json::object object{{"name", host.name},
                            {"requests", host.requests},
                            {"failed", host.failed},
                            {"busy_seconds", to_seconds(host.busy)},
                            {"percent", tenths(host.percent)},
                            {"last_error", nullptr},
                            {"last_error_ms", nullptr}};
        if (host.last_error) {
            object["last_error"] = label(*host.last_error);
            object["last_error_ms"] = whole_ms(host.last_error_ago);
        }
        list.push_back(std::move(object));
    }
    return list;
}

/// As a finding of a line (lines.cpp), with its line, its clients and its begin.
json::object describe(const Finding& finding, bool with_clients) {
    json::object figures;
    for (const auto& [name, value] : finding.figures) figures[name] = value;
    json::object object{{"cause", finding.cause},   {"line", nullptr},
                        {"station", nullptr},       {"name", finding.name},
                        {"text", finding.text},     {"advice", finding.advice},
                        {"evidence", ""},           {"figures", std::move(figures)},
                        {"clients", json::array()}, {"since", rfc3339(finding.since)}};
    if (!finding.line.empty()) object["line"] = finding.line;
    // Who asks, and how much, is about all stations of the line.
    if (!with_clients) return object;
    object["evidence"] = finding.evidence;
    object["clients"] = describe(finding.clients);
    return object;
}

void add(json::object& object, const bus::RequestCounts& counts) {
    object["requests"] = counts.requests;
    object["errors"] = counts.errors;
    object["no_turn"] = counts.no_turn;
    object["transactions"] = counts.transactions;
    object["transaction_ms"] = nullptr;
    if (counts.transactions > 0)
        object["transaction_ms"] =
            tenths(1000 * counts.wire / static_cast<double>(counts.transactions));
}

json::object describe(const LineUsage& usage, const Sight& sight, bool whole) {
    json::object object{{"line", usage.line},
                        {"seconds", tenths(to_seconds(usage.minute.span))},
                        {"load_percent", tenths(usage.minute.load_percent)}};
    bus::RequestCounts all;
    json::array stations;
    for (const auto& [name, counts] : usage.minute.stations) {
        if (!sight.named(usage.line, name, "")) continue;
        json::object station{{"station", name}};
        add(station, counts);
        stations.push_back(std::move(station));
        all += counts;
    }
    add(object, all);
    object["stations"] = std::move(stations);
    object["clients"] = whole ? describe(usage.minute.hosts) : json::array();
    return object;
}

}  // namespace

Handling get_findings(HttpRequest request, const Api* api) {
    const Sight sight(*api->directory, request.caller->who());
    json::array list;
    for (const Finding& finding :
         api->providers.findings ? api->providers.findings() : std::vector<Finding>()) {
        const LineEntry* const line = api->directory->find_line(finding.line);
        if (line != nullptr ? sight.line(*line) : sight.everything())
            list.push_back(describe(finding, line == nullptr || sight.whole(*line)));
    }
    co_return json_response(200, json::object{{"findings", std::move(list)}});
}

Handling get_usage(HttpRequest request, const Api* api) {
    const Sight sight(*api->directory, request.caller->who());
    json::array list;
    for (const LineUsage& usage :
         api->providers.usage ? api->providers.usage() : std::vector<LineUsage>()) {
        const LineEntry* const line = api->directory->find_line(usage.line);
        if (line != nullptr && sight.line(*line))
            list.push_back(describe(usage, sight, sight.whole(*line)));
    }
    co_return json_response(200, json::object{{"lines", std::move(list)}});
}

}  // namespace panelgate::web
