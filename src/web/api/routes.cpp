#include "routes.hpp"

#include <algorithm>
#include <iterator>

#include "answer.hpp"
#include "once.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "sight.hpp"

namespace panelgate::web {

namespace {

/// What the answers of a route have in addition to its handler's answer.
struct RoutePolicy {
    bool asks = false;    ///< it asks lines: the answer lists its transactions
    bool once = false;    ///< a write: it accepts Idempotency-Key
    bool tagged = false;  ///< a status: it has an ETag
};

constexpr Role kFree = Role::none;
constexpr Role kSee = Role::viewer;
constexpr Role kChange = Role::operator_;
constexpr Role kEngineer = Role::engineer;
constexpr Role kAdmin = Role::admin;
constexpr std::string_view kReading = "count type order length raw";

/// A page contains no data of the plant: every client gets it, and its token requests the data.
constexpr Role kPage = Role::none;
constexpr bool kProbe = true;

constexpr Shown kShowsNone = Shown::nothing;
constexpr Shown kShowsLine = Shown::line;
constexpr Shown kShowsAll = Shown::whole_line;
constexpr Shown kShowsStation = Shown::station;
constexpr Shown kShowsPoint = Shown::point;

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
    Shown shows = Shown::nothing;  ///< of what the path names
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
    {"GET", "/healthz", get_healthz, kFree, kShowsNone, kPlain, {}, kProbe},
    {"GET", "/readyz", get_readyz, kFree, kShowsNone, kPlain, "active", kProbe},
    {"GET", "/metrics", get_metrics, kSee},
    {"GET", "/api/v1/version", get_version, kSee},
    {"GET", "/api/v1/configuration", get_configuration, kSee},
    {"GET", "/api/v1/configuration/text", get_configuration_text, kAdmin},
    {"PUT", "/api/v1/configuration/text", put_configuration_text, kAdmin},
    {"POST", "/api/v1/configuration/check", post_configuration_check, kAdmin},
    {"POST", "/api/v1/configuration/insert", post_configuration_insert, kAdmin},
    {"GET", "/api/v1/configuration/versions", get_configuration_versions, kAdmin},
    {"GET", "/api/v1/configuration/versions/{}", get_configuration_version, kAdmin},
    {"GET", "/api/v1/configuration/schema", get_configuration_schema, kAdmin},
    {"POST", "/api/v1/configuration/rollback", post_configuration_rollback, kAdmin, kShowsNone,
     kOnce},
    {"GET", "/api/v1/reload", get_reload, kSee},
    {"POST", "/api/v1/reload", post_reload, kAdmin, kShowsNone, kOnce, "rollback weaker"},
    {"GET", "/api/v1/lines", get_lines, kSee, kShowsNone, kTagged},
    {"GET", "/api/v1/lines/{}", get_line, kSee, kShowsLine, kTagged},
    {"GET", "/api/v1/lines/{}/trace", get_trace, kSee, kShowsAll, kPlain, "last since"},
    {"GET", "/api/v1/lines/{}/history", get_line_history, kSee, kShowsAll},
    {"GET", "/api/v1/lines/{}/trace.pcapng", get_trace_pcapng, kSee, kShowsAll},
    {"GET", "/api/v1/lines/{}/incidents", get_incidents, kSee, kShowsAll, kTagged},
    {"GET", "/api/v1/lines/{}/incidents/{}", get_incident, kSee, kShowsAll},
    {"POST", "/api/v1/lines/{}/broadcast", post_broadcast, kEngineer, kShowsNone, kWrites},
    {"POST", "/api/v1/lines/{}/raw", post_raw, kEngineer, kShowsNone, kWrites},
    {"GET", "/api/v1/lines/{}/discover", get_discovery, kSee, kShowsAll},
    {"POST", "/api/v1/lines/{}/discover", post_discover, kEngineer, kShowsAll, kOnce},
    {"DELETE", "/api/v1/lines/{}/discover", delete_discovery, kEngineer, kShowsAll, kOnce},
    {"POST", "/api/v1/read", post_read, kSee, kShowsNone, kAsks},
    {"POST", "/api/v1/write", post_write, kChange, kShowsNone, kWrites},
    {"GET", "/api/v1/stations", get_stations, kSee, kShowsNone, kTagged, "overview"},
    {"GET", "/api/v1/stations/{}", get_station, kSee, kShowsStation, kTagged},
    {"GET", "/api/v1/simulator/{}", get_simulated, kSee, kShowsStation},
    {"PUT", "/api/v1/simulator/{}", put_simulated, kEngineer, kShowsStation},
    {"GET", "/api/v1/events", get_events, kSee, kShowsNone, kPlain, "types line station point"},
    {"GET", "/api/v1/relays", get_relays, kSee, kShowsNone, kTagged},
    {"GET", "/api/v1/findings", get_findings, kSee, kShowsNone, kTagged},
    {"GET", "/api/v1/usage", get_usage, kSee},
    {"GET", "/api/v1/points", get_all_points, kSee, kShowsNone, kTagged},
    {"GET", "/api/v1/stations/{}/points", get_points, kSee, kShowsStation, kTagged, "raw"},
    {"GET", "/api/v1/stations/{}/points/{}", get_point, kSee, kShowsPoint, kMayAsk, "raw"},
    {"PUT", "/api/v1/stations/{}/points/{}", put_point, kChange, kShowsNone, kWrites, "round"},
    {"GET", "/api/v1/stations/{}/points/{}/history", get_point_history, kSee, kShowsPoint, kPlain,
     "from to step"},
    {"GET", "/api/v1/standby", get_standby, kSee},
    {"GET", "/api/v1/images", get_images, kSee, kShowsNone, kTagged},
    {"GET", "/api/v1/images/{}", get_image, kSee, kShowsNone, kTagged},
    {"GET", "/api/v1/alarms", get_alarms, kSee, kShowsNone, kTagged},
    {"POST", "/api/v1/alarms/{}/acknowledge", post_acknowledge, kChange, kShowsNone, kOnce},
    {"GET", "/api/v1/journal", get_journal, kSee, kShowsNone, kPlain,
     "since until kind station limit after"},
    {"GET", "/api/v1/stations/{}/{}/{}/interpretations", get_interpretations, kSee, kShowsStation,
     kAsks, "count"},
    // Before the table routes: "points" and "devices" are no tables.
    {"GET", "/api/v1/stations/{}/points/{}/plan", get_point_plan, kSee, kShowsPoint, kTagged,
     "value"},
    {"GET", "/api/v1/stations/{}/devices/{}/plan", get_device_plan, kSee, kShowsStation, kTagged,
     "count values"},
    {"GET", "/api/v1/stations/{}/{}/{}/plan", get_table_plan, kSee, kShowsStation, kTagged,
     "count values"},
    {"GET", "/api/v1/stations/{}/devices/{}", get_device, kSee, kShowsNone, kAsks, kReading},
    {"PUT", "/api/v1/stations/{}/devices/{}", put_device, kChange, kShowsNone, kWrites},
    {"GET", "/api/v1/stations/{}/{}/{}", get_table, kSee, kShowsNone, kAsks, kReading},
    {"PUT", "/api/v1/stations/{}/{}/{}", put_table, kChange, kShowsNone, kWrites},
};

bool configures(const Row& row) { return row.pattern.starts_with("/api/v1/configuration/"); }

/// The right that a role of the configuration needs for the route.
Right right_for(const Row& row) {
    if (configures(row)) return Right::configure;
    if (row.needed == kSee) return Right::read;
    if (row.pattern.ends_with("/acknowledge")) return Right::acknowledge;
    if (row.needed == kChange) return Right::write;
    if (row.needed == kAdmin) return Right::reload;
    if (row.pattern.ends_with("/raw")) return Right::raw;
    if (row.pattern.ends_with("/broadcast")) return Right::broadcast;
    return row.pattern.ends_with("/discover") ? Right::discover : Right::simulator;
}

/// A role that may change something may also read how the change went.
std::optional<Right> other_right_for(const Row& row) {
    if (row.needed != kSee) return std::nullopt;
    if (row.pattern.ends_with("/discover")) return Right::discover;
    if (row.pattern.ends_with("/simulator/{}")) return Right::simulator;
    if (row.pattern.ends_with("/reload")) return Right::reload;
    return std::nullopt;
}

/// The right by which a role of the configuration sees what the path names.
Right sight_right(const Row& row) { return other_right_for(row).value_or(right_for(row)); }

std::vector<std::string_view> words_of(std::string_view text) {
    std::vector<std::string_view> words;
    while (!text.empty()) {
        const auto end = std::min(text.find(' '), text.size());
        words.push_back(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return words;
}

/// "17, 18", or "floor1:17, floor2:3" for several lines. A transaction that several parts of a
/// request share is listed once.
std::string text_of(const std::vector<Caller::Cost>& costs, const Directory& directory) {
    constexpr std::size_t kLongest = 4000;  // characters: clients accept headers of 8,192
    const bool one_line = std::ranges::all_of(
        costs, [&](const Caller::Cost& cost) { return cost.line == costs.front().line; });
    std::string text;
    for (auto cost = costs.begin(); cost != costs.end(); ++cost) {
        if (std::find(costs.begin(), cost, *cost) != cost) continue;
        std::string one = std::to_string(cost->transaction);
        const auto line = std::ranges::find(directory.lines, cost->line, &LineEntry::bus);
        if (!one_line && line != directory.lines.end()) one.insert(0, line->name + ':');
        if (text.size() + one.size() + 2 > kLongest) break;
        text += (text.empty() ? "" : ", ") + one;
    }
    return text;
}

/// The handler's answer, with a Panelgate-Transactions header if it asked lines.
Handling costed(HttpRequest request, const Api* api, Handler handler) {
    const std::shared_ptr<Caller> caller = request.caller;
    caller->take_costs();
    Handling work = handler(std::move(request), api);
    HttpResponse response = co_await std::move(work);
    if (caller->has_left()) co_return response;
    const std::vector<Caller::Cost> costs = caller->take_costs();
    if (!costs.empty())
        response.headers.emplace_back("Panelgate-Transactions", text_of(costs, *api->directory));
    co_return response;
}

Handling handled(HttpRequest request, const Api* api, const Row& row) {
    if (row.policy.once)
        return once(api->keys, std::move(request), api->providers.now,
                    [api, handler = row.handler](HttpRequest one) {
                        return costed(std::move(one), api, handler);
                    });
    if (row.policy.asks) return costed(std::move(request), api, row.handler);
    return row.handler(std::move(request), api);
}

bool has_header(const HttpResponse& response, std::string_view name) {
    return std::ranges::any_of(response.headers,
                               [&](const auto& header) { return header.first == name; });
}

/// True if the gateway itself found a fault: a bus would have judged the client as well.
bool is_found_wrong_here(const HttpResponse& response) {
    return response.status >= 400 && response.status < 500 && response.status != 403 &&
           !has_header(response, "Panelgate-Transactions") &&
           response.body.find("\"modbus_exception\":") == std::string::npos;
}

/// Packs the body with gzip if the client accepts gzip.
void pack(HttpResponse& response, bool takes_gzip) {
    if (response.events || response.shared_body || has_header(response, "Content-Encoding")) return;
    add_vary(response, "Accept-Encoding");
    if (!takes_gzip) return;
    response.body = packed(response.body);
    response.headers.emplace_back("Content-Encoding", "gzip");
}

/// Runs the handler and applies the route's policy. The loop of the faces makes the tag and the
/// packed body.
Handling conduct(HttpRequest request, const Api* api, const Row* row) {
    const std::shared_ptr<Caller> caller = request.caller;
    const Directory* const directory = api->directory;
    const std::size_t gzip_from = api->providers.settings.gzip_from;
    const bool takes_gzip = accepts_gzip(request.headers["accept-encoding"]);
    const std::string if_none_match = request.headers["if-none-match"];
    const std::vector<std::string> path = request.path;
    if (directory != nullptr) {
        if (const auto hidden = check_sight(request, *directory, row->shows, sight_right(*row)))
            co_return to_response(*hidden);
    }
    HttpResponse response;
    try {
        Handling work = handled(std::move(request), api, *row);
        response = co_await std::move(work);
    } catch (const Refused& refused) {
        response = to_response(refused.problem);
    }
    if (caller->has_left()) co_return response;
    if (directory != nullptr && is_found_wrong_here(response)) {
        if (const auto hidden = instead_of_telling(path, caller->who(), *directory))
            co_return to_response(*hidden);
    }
    response.finish = [make = std::move(response.finish), tagged = row->policy.tagged,
                       if_none_match, takes_gzip, gzip_from](HttpResponse& made) {
        if (make) make(made);
        if (tagged && made.status == 200 && add_etag(made, if_none_match, tag_of(made.body)))
            made.body.clear();
        if (made.body.size() >= gzip_from) pack(made, takes_gzip);
    };
    co_return response;
}

}  // namespace

std::vector<Route> routes(std::shared_ptr<const Api> api) {
    std::vector<Route> made;
    for (const Row& row : kRows) {
        const auto call = [api, &row](HttpRequest request) {
            return conduct(std::move(request), api.get(), &row);
        };
        const bool face = std::ranges::find(kOfFaces, row.handler) != std::end(kOfFaces);
        made.push_back({row.verb, row.pattern, row.needed, call, words_of(row.queries), row.probe,
                        face, row.handler == get_metrics, right_for(row), other_right_for(row),
                        configures(row)});
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
