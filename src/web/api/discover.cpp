#include <boost/json/array.hpp>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "answer.hpp"
#include "body.hpp"
#include "handlers.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/web/api/discovery_source.hpp"
#include "panelgate/web/http/client_log.hpp"
#include "refusal.hpp"
#include "station_path.hpp"

namespace panelgate::web {
namespace json = boost::json;

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

/// Why nobody can be looked for on this line now.
std::optional<Problem> barred(const LineEntry& line, const DiscoverySource& source) {
    const bus::LineStatus status = line.bus->status();
    // Its refusal of a write says who is master there.
    if (const auto refusal = line.bus->refusal_of_write(0); status.listens && refusal)
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

}  // namespace panelgate::web
