#include "http/router.hpp"

#include <initializer_list>
#include <string_view>

#include "http/access.hpp"

namespace panelgate::web {
namespace {

struct Route {
    std::string_view verb;
    std::string_view pattern;  ///< {} stands for any one segment
    Handling (*handler)(HttpRequest, const Api*);
    Role needed;
};

constexpr Role kFree = Role::none;
constexpr Role kSee = Role::viewer;
constexpr Role kChange = Role::operator_;
constexpr Route kRoutes[] = {
    {"GET", "/", get_index, kSee},
    {"GET", "/healthz", get_healthz, kFree},
    {"GET", "/readyz", get_readyz, kFree},
    {"GET", "/metrics", get_metrics, kSee},
    {"GET", "/api/v1/lines", get_lines, kSee},
    {"GET", "/api/v1/lines/{}", get_line, kSee},
    {"GET", "/api/v1/lines/{}/trace", get_trace, kSee},
    {"POST", "/api/v1/lines/{}/broadcast", post_broadcast, kChange},
    {"POST", "/api/v1/lines/{}/raw", post_raw, kChange},
    {"GET", "/api/v1/stations", get_stations, kSee},
    {"GET", "/api/v1/stations/{}", get_station, kSee},
    {"GET", "/api/v1/simulator/{}", get_simulated, kSee},
    {"PUT", "/api/v1/simulator/{}", put_simulated, kChange},
    {"GET", "/api/v1/events", get_events, kSee},
    {"GET", "/api/v1/relays", get_relays, kSee},
    {"GET", "/api/v1/stations/{}/points", get_points, kSee},
    {"GET", "/api/v1/stations/{}/points/{}", get_point, kSee},
    {"PUT", "/api/v1/stations/{}/points/{}", put_point, kChange},
    {"GET", "/api/v1/stations/{}/{}/{}/interpretations", get_interpretations, kSee},
    // Before the tables: "devices" is none of them.
    {"GET", "/api/v1/stations/{}/devices/{}", get_device, kSee},
    {"PUT", "/api/v1/stations/{}/devices/{}", put_device, kChange},
    {"GET", "/api/v1/stations/{}/{}/{}", get_table, kSee},
    {"PUT", "/api/v1/stations/{}/{}/{}", put_table, kChange},
};

/// What the pattern's {} stand for in this path, or nothing when it does not match.
std::optional<std::vector<std::string>> match(std::string_view pattern,
                                              const std::vector<std::string>& path) {
    std::vector<std::string> arguments;
    pattern.remove_prefix(1);
    for (const std::string& segment : path) {
        if (pattern.empty()) return std::nullopt;
        const auto end = pattern.find('/');
        const std::string_view wanted = pattern.substr(0, end);
        pattern = end == pattern.npos ? std::string_view() : pattern.substr(end + 1);
        if (wanted == "{}") {
            arguments.push_back(segment);
        } else if (wanted != segment) {
            return std::nullopt;
        }
    }
    if (!pattern.empty()) return std::nullopt;
    return arguments;
}

struct Found {
    const Route* route = nullptr;
    std::vector<std::string> arguments;
    std::string allow;  ///< methods of the path; empty: no such path
};

Found find_route(const HttpRequest& request) {
    std::string_view verb = request.method;
    if (verb == "HEAD") verb = "GET";
    Found found;
    for (const Route& route : kRoutes) {
        auto arguments = match(route.pattern, request.path);
        if (!arguments) continue;
        if (route.verb == verb) {
            found.route = &route;
            found.arguments = std::move(*arguments);
            return found;
        }
        if (found.allow.find(route.verb) != std::string::npos) continue;
        if (!found.allow.empty()) found.allow += ", ";
        found.allow += route.verb == "GET" ? "GET, HEAD" : route.verb;
    }
    return found;
}

Problem not_found(const Found& found) {
    if (found.allow.empty()) return problem(404, "there is nothing at this path");
    Problem made = problem(405, "this path understands " + found.allow);
    made.headers.emplace_back("Allow", found.allow);
    return made;
}

}  // namespace

Handling dispatch(HttpRequest request, const Api* api) {
    Found found = find_route(request);
    if (found.route == nullptr) co_return to_response(not_found(found));
    const auto refused = check_access(request, found.route->needed, api->settings);
    if (refused) co_return to_response(*refused);
    request.arguments = std::move(found.arguments);
    Handling handling = found.route->handler(std::move(request), api);
    HttpResponse response = co_await std::move(handling);
    co_return response;
}

}  // namespace panelgate::web
