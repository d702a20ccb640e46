#include "router.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "access.hpp"
#include "panelgate/web/http/problem.hpp"
#include "panelgate/web/http/query.hpp"

namespace panelgate::web {
namespace {

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

Found find_route(const HttpRequest& request, const std::vector<Route>& routes) {
    std::string_view verb = request.method;
    if (verb == "HEAD") verb = "GET";
    Found found;
    for (const Route& route : routes) {
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

Handling dispatch(HttpRequest request, const Site* site) {
    Found found = find_route(request, site->routes);
    if (found.route == nullptr) co_return to_response(not_found(found));
    const auto refused = check_access(request, found.route->needed, site->settings);
    if (refused) co_return to_response(*refused);
    const auto mistaken = check_queries(request, found.route->queries);
    if (mistaken) co_return to_response(*mistaken);
    if (request.caller) request.caller->uses_token(token_name(request, site->settings));
    request.arguments = std::move(found.arguments);
    Handling handling = found.route->handler(std::move(request));
    HttpResponse response = co_await std::move(handling);
    co_return response;
}

}  // namespace panelgate::web
