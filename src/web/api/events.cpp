#include <algorithm>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "handlers.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {
namespace {

constexpr std::string_view kTypes[] = {"point", "station", "line", "transaction"};

/// types=point,station
Parsed<std::set<std::string>> types_of(const HttpRequest& request) {
    std::set<std::string> types;
    const auto given = request.query.find("types");
    if (given == request.query.end()) return types;
    std::istringstream in(given->second);
    for (std::string type; std::getline(in, type, ',');) {
        if (std::ranges::find(kTypes, type) == std::end(kTypes))
            return problem(400, "there is no event '" + type +
                                    "'; types are point, station, line and transaction");
        types.insert(type);
    }
    return types;
}

}  // namespace

Handling get_events(HttpRequest request, const Api* api) {
    auto types = types_of(request);
    if (!types) co_return to_response(types.error());
    auto listener = api->providers.events->listen(std::move(*types));
    if (!listener) {
        Problem full = problem(503, "too many listen to events already");
        full.headers.emplace_back("Retry-After", "5");
        co_return to_response(full);
    }
    HttpResponse response;
    response.content_type = "text/event-stream";
    response.events = std::move(listener);
    co_return response;
}

}  // namespace panelgate::web
