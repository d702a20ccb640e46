#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "body.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/web/api/sources.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/web/http/message.hpp"
#include "routes.hpp"
#include "sight.hpp"
#include "station_path.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

/// In the list of lines a finding is reduced to its cause.
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

/// Findings only of stations that may be seen.
bus::LineStatus status_of(const LineEntry& line, const Sight& sight) {
    bus::LineStatus status = line.bus->status();
    std::erase_if(status.findings, [&](const bus::LineFinding& finding) {
        return finding.station && !sight.station(line, *finding.station);
    });
    return status;
}

}  // namespace

Handling get_lines(HttpRequest request, const Api* api) {
    const Sight sight(*api->directory, request.caller->who());
    LongAnswer body;
    body.begin_list("lines");
    for (std::size_t i = 0; i < api->directory->lines.size(); ++i) {
        const LineEntry& line = api->directory->lines[i];
        if (sight.line(line)) body.add(describe(line, status_of(line, sight)));
        if (!body.is_turn_over()) continue;
        boost::asio::awaitable<void> turn = yield_turn();
        co_await std::move(turn);
        if (request.caller->has_left()) co_return HttpResponse{};
    }
    body.end_list();
    co_return body.response();
}

Handling get_line(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const Sight sight(*api->directory, request.caller->who());
    const bus::LineStatus status = status_of(**line, sight);
    json::object body = describe(**line, status);
    body["findings"] = describe(status.findings);
    std::vector<bus::ClientShare> clients = (*line)->bus->clients();
    // Whom they ask, and what they get, is about all stations.
    if (!sight.whole(**line)) clients.clear();
    body["clients"] = describe(clients);
    co_return json_response(200, body);
}

std::string_view label(DiscoveryReport::State state) {
    switch (state) {
        case DiscoveryReport::State::never:
            return "never";
        case DiscoveryReport::State::running:
            return "running";
        case DiscoveryReport::State::done:
            return "done";
        case DiscoveryReport::State::stopped:
            return "stopped";
    }
    std::abort();
}

namespace {

constexpr std::int64_t kDefaultShare = 10;  ///< %
constexpr std::int64_t kMostShare = 50;
constexpr const char* kAll = "1-247";

json::object describe(const std::string& line, const DiscoveryReport& report) {
    json::object object;
    object["line"] = line;
    object["state"] = label(report.state);
    object["share_percent"] = report.share_percent;
    object["asked"] = report.asked;
    object["refused"] = report.refused;
    object["of"] = report.of;
    object["asked_stations"] = report.asked_stations;
    object["silent_stations"] = report.silent_stations;
    object["found"] = report.stations.size();
    object["bus_ms"] = whole_ms(report.bus);
    object["took_ms"] = whole_ms(report.took);
    if (report.remaining) object["remaining_ms"] = whole_ms(*report.remaining);
    if (!report.why.empty()) object["why"] = report.why;
    json::array stations;
    for (const DiscoveredStation& station : report.stations) {
        stations.push_back(json::object{
            {"id", station.id},
            {"profiles", json::array(station.profiles.begin(), station.profiles.end())},
            {"evidence", station.evidence}});
    }
    object["stations"] = std::move(stations);
    object["yaml"] = report.yaml;
    return object;
}

struct Wanted {
    std::string stations = kAll;
    unsigned share = kDefaultShare;
};

Parsed<Wanted> wanted_of(std::string_view text) {
    Wanted wanted;
    if (text.empty()) return wanted;
    const auto body = parse_object(text, {"stations", "share_percent"});
    if (!body) return body.error();
    if (body->contains("stations")) {
        const auto stations = string_member(*body, "stations");
        if (!stations) return stations.error();
        wanted.stations = *stations;
    }
    if (body->contains("share_percent")) {
        const auto share = number_member(*body, "share_percent", 1, kMostShare);
        if (!share) return share.error();
        wanted.share = static_cast<unsigned>(*share);
    }
    return wanted;
}

/// Why no discovery can start on this line now.
std::optional<Problem> barred(const LineEntry& line, const DiscoverySource& source) {
    const bus::LineStatus status = line.bus->status();
    // A listening line's refusal of a write names the reason: another master.
    if (const auto refusal = line.bus->write_refusal(0); status.listens && refusal)
        return problem_of(*refusal);
    if (source.report(line.name).state == DiscoveryReport::State::running)
        return problem(409, "stations are being looked for on line '" + line.name + "' already");
    if (status.up) return std::nullopt;
    Problem down = problem_of(Fault::line_down, false);
    down.detail = "the line is " + status.state;
    return down;
}

}  // namespace

Handling get_discovery(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const std::string& name = (*line)->name;
    co_return json_response(200, describe(name, api->providers.discovery->report(name)));
}

Handling post_discover(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const auto wanted = wanted_of(request.body);
    if (!wanted) co_return to_response(wanted.error());
    DiscoverySource& source = *api->providers.discovery;
    if (const auto problem = barred(**line, source)) co_return to_response(*problem);
    const std::string& name = (*line)->name;
    if (const auto wrong = source.start(name, wanted->stations, wanted->share))
        co_return to_response(problem(400, "stations " + *wrong));
    log_client(*request.caller, "discovery started",
               {{"line", name}, {"stations", wanted->stations}});
    request.caller->take_effect();
    co_return json_response(202, describe(name, source.report(name)));
}

Handling delete_discovery(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const std::string& name = (*line)->name;
    if (api->providers.discovery->report(name).state == DiscoveryReport::State::running)
        log_client(*request.caller, "discovery stopped", {{"line", name}});
    api->providers.discovery->stop(name);
    co_return json_response(200, describe(name, api->providers.discovery->report(name)));
}

namespace {

Parsed<StationEntry> find_simulated(const Directory& directory, const std::string& name) {
    auto station = find_station(directory, name);
    if (station && !station->simulated)
        return problem(404, "station '" + name + "' is not simulated");
    return station;
}

/// The body's members as numbers; true is 1 and false is 0.
Parsed<std::map<std::string, double>> numbers_of(const json::object& body) {
    std::map<std::string, double> numbers;
    for (const auto& [key, value] : body) {
        if (!value.is_number() && !value.is_bool())
            return problem(400, "the fault '" + excerpt(std::string(key)) +
                                    "' must be a number, true or false");
        numbers[key] = value.is_bool() ? (value.get_bool() ? 1 : 0) : value.to_number<double>();
    }
    return numbers;
}

HttpResponse faults_of(const StationEntry& station) {
    json::object faults;
    for (const auto& [name, value] : station.simulated->faults()) faults[name] = value;
    json::object body;
    body["station"] = station.name;
    body["faults"] = std::move(faults);
    return json_response(200, body);
}

}  // namespace

Handling get_simulated(HttpRequest request, const Api* api) {
    const auto station = find_simulated(*api->directory, request.arguments[0]);
    if (!station) co_return to_response(station.error());
    co_return faults_of(*station);
}

Handling put_simulated(HttpRequest request, const Api* api) {
    const auto station = find_simulated(*api->directory, request.arguments[0]);
    if (!station) co_return to_response(station.error());
    const auto body = parse_object(request.body);
    if (!body) co_return to_response(body.error());
    const auto numbers = numbers_of(*body);
    if (!numbers) co_return to_response(numbers.error());
    if (const auto wrong = station->simulated->set_faults(*numbers))
        co_return to_response(problem(400, *wrong));
    log_client(*request.caller, "simulator faults set",
               {{"station", station->name}, {"faults", json_text(*body)}});
    co_return faults_of(*station);
}

}  // namespace panelgate::web
