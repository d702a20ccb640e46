#include "routes.hpp"

#include <algorithm>
#include <boost/json/object.hpp>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>

#include "conduct.hpp"

namespace panelgate::web {

namespace {

constexpr Role kFree = Role::none;
constexpr Role kSee = Role::viewer;
constexpr Role kChange = Role::operator_;
constexpr Role kEngineer = Role::engineer;
constexpr Role kAdmin = Role::admin;
constexpr std::string_view kReading = "count type order length raw";

/// A page contains no data of the plant: every client gets it, and its token requests the data.
constexpr Role kPage = Role::none;
constexpr bool kProbe = true;

constexpr RoutePolicy kPlain{};
constexpr RoutePolicy kTagged{.tagged = true};
constexpr RoutePolicy kAsks{.asks = true};
constexpr RoutePolicy kMayAsk{.asks = true, .tagged = true};
constexpr RoutePolicy kOnce{.once = true};
constexpr RoutePolicy kWrites{.asks = true, .once = true};

struct Row {
    std::string_view verb;
    std::string_view pattern;
    Handler handler;
    Role needed;
    RoutePolicy policy = {};
    std::string_view queries = {};  ///< separated by blanks
    bool probe = false;
};
/// Handlers that need only what never changes, or the events.
constexpr Handler kOfFaces[] = {get_index, get_page, get_docs, get_manual, get_openapi, get_events};

constexpr Row kRows[] = {
    {"GET", "/", get_index, kPage},
    {"GET", "/page/{}", get_page, kPage},
    {"GET", "/docs", get_docs, kPage},
    {"GET", "/docs/{}", get_manual, kPage},
    {"GET", "/docs/{}/{}", get_manual, kPage},
    {"GET", "/openapi.json", get_openapi, kSee},
    {"GET", "/healthz", get_healthz, kFree, kPlain, {}, kProbe},
    {"GET", "/readyz", get_readyz, kFree, kPlain, {}, kProbe},
    {"GET", "/metrics", get_metrics, kSee},
    {"GET", "/api/v1/version", get_version, kSee},
    {"GET", "/api/v1/configuration", get_configuration, kSee},
    {"GET", "/api/v1/reload", get_reload, kSee},
    {"POST", "/api/v1/reload", post_reload, kAdmin, kOnce, "rollback weaker"},
    {"GET", "/api/v1/lines", get_lines, kSee, kTagged},
    {"GET", "/api/v1/lines/{}", get_line, kSee, kTagged},
    {"GET", "/api/v1/lines/{}/trace", get_trace, kSee, kPlain, "last since"},
    {"GET", "/api/v1/lines/{}/history", get_line_history, kSee},
    {"GET", "/api/v1/lines/{}/trace.pcapng", get_trace_pcapng, kSee},
    {"GET", "/api/v1/lines/{}/incidents", get_incidents, kSee, kTagged},
    {"GET", "/api/v1/lines/{}/incidents/{}", get_incident, kSee},
    {"POST", "/api/v1/lines/{}/broadcast", post_broadcast, kEngineer, kWrites},
    {"POST", "/api/v1/lines/{}/raw", post_raw, kEngineer, kWrites},
    {"GET", "/api/v1/lines/{}/discover", get_discovery, kSee},
    {"POST", "/api/v1/lines/{}/discover", post_discover, kEngineer, kOnce},
    {"DELETE", "/api/v1/lines/{}/discover", delete_discovery, kEngineer, kOnce},
    {"POST", "/api/v1/read", post_read, kSee, kAsks},
    {"POST", "/api/v1/write", post_write, kChange, kWrites},
    {"GET", "/api/v1/stations", get_stations, kSee, kTagged},
    {"GET", "/api/v1/stations/{}", get_station, kSee, kTagged},
    {"GET", "/api/v1/simulator/{}", get_simulated, kSee},
    {"PUT", "/api/v1/simulator/{}", put_simulated, kEngineer},
    {"GET", "/api/v1/events", get_events, kSee, kPlain, "types line station point"},
    {"GET", "/api/v1/relays", get_relays, kSee, kTagged},
    {"GET", "/api/v1/points", get_all_points, kSee, kTagged},
    {"GET", "/api/v1/stations/{}/points", get_points, kSee, kTagged, "raw"},
    {"GET", "/api/v1/stations/{}/points/{}", get_point, kSee, kMayAsk, "raw"},
    {"PUT", "/api/v1/stations/{}/points/{}", put_point, kChange, kWrites, "round"},
    {"GET", "/api/v1/stations/{}/points/{}/history", get_point_history, kSee},
    {"GET", "/api/v1/stations/{}/{}/{}/interpretations", get_interpretations, kSee, kAsks, "count"},
    // Before the table routes: "devices" is not a table.
    {"GET", "/api/v1/stations/{}/devices/{}/plan", get_device_plan, kSee, kTagged, "count values"},
    {"GET", "/api/v1/stations/{}/{}/{}/plan", get_table_plan, kSee, kTagged, "count values"},
    {"GET", "/api/v1/stations/{}/devices/{}", get_device, kSee, kAsks, kReading},
    {"PUT", "/api/v1/stations/{}/devices/{}", put_device, kChange, kWrites},
    {"GET", "/api/v1/stations/{}/{}/{}", get_table, kSee, kAsks, kReading},
    {"PUT", "/api/v1/stations/{}/{}/{}", put_table, kChange, kWrites},
};

/// What a role of the configuration has to have for it.
Right right_for(const Row& row) {
    if (row.needed == kSee) return Right::read;
    if (row.needed == kChange) return Right::write;
    if (row.needed == kAdmin) return Right::reload;
    if (row.pattern.ends_with("/raw")) return Right::raw;
    if (row.pattern.ends_with("/broadcast")) return Right::broadcast;
    return row.pattern.ends_with("/discover") ? Right::discover : Right::simulator;
}

/// Who may do something is told how it went.
std::optional<Right> other_right_for(const Row& row) {
    if (row.needed != kSee) return std::nullopt;
    if (row.pattern.ends_with("/discover")) return Right::discover;
    if (row.pattern.ends_with("/simulator/{}")) return Right::simulator;
    if (row.pattern.ends_with("/reload")) return Right::reload;
    return std::nullopt;
}

std::vector<std::string_view> words_of(std::string_view text) {
    std::vector<std::string_view> words;
    while (!text.empty()) {
        const auto end = std::min(text.find(' '), text.size());
        words.push_back(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return words;
}

}  // namespace

std::vector<Route> routes(std::shared_ptr<const Api> api) {
    std::vector<Route> made;
    for (const Row& row : kRows) {
        const auto call = [api, &row](HttpRequest request) {
            return conduct(std::move(request), api.get(), row.handler, row.policy);
        };
        const bool face = std::ranges::find(kOfFaces, row.handler) != std::end(kOfFaces);
        made.push_back({row.verb, row.pattern, row.needed, call, words_of(row.queries), row.probe,
                        face, row.handler == get_metrics, right_for(row), other_right_for(row)});
    }
    return made;
}

boost::json::array offered() {
    boost::json::array list;
    for (const Row& row : kRows) {
        list.push_back(boost::json::object{
            {"method", row.verb}, {"path", row.pattern}, {"role", label(row.needed)}});
        if (row.needed != Role::none) list.back().as_object()["right"] = label(right_for(row));
    }
    return list;
}

std::vector<Route> simulator_routes(std::shared_ptr<const Api> api) {
    std::vector<Route> some = routes(std::move(api));
    std::erase_if(some, [](const Route& route) {
        return route.pattern != "/healthz" && route.pattern != "/readyz" &&
               !route.pattern.starts_with("/api/v1/simulator/");
    });
    return some;
}

}  // namespace panelgate::web
