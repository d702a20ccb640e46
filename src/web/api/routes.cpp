#include "routes.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

namespace panelgate::web {
namespace {

constexpr Role kFree = Role::none;
constexpr Role kSee = Role::viewer;
constexpr Role kChange = Role::operator_;

struct Row {
    std::string_view verb;
    std::string_view pattern;
    Handling (*handler)(HttpRequest, const Api*);
    Role needed;
    std::string_view queries = {};  ///< with a blank between them
};
constexpr Row kRows[] = {
    {"GET", "/", get_index, kSee},
    {"GET", "/healthz", get_healthz, kFree},
    {"GET", "/readyz", get_readyz, kFree},
    {"GET", "/metrics", get_metrics, kSee},
    {"GET", "/api/v1/lines", get_lines, kSee},
    {"GET", "/api/v1/lines/{}", get_line, kSee},
    {"GET", "/api/v1/lines/{}/trace", get_trace, kSee, "last since"},
    {"POST", "/api/v1/lines/{}/broadcast", post_broadcast, kChange},
    {"POST", "/api/v1/lines/{}/raw", post_raw, kChange},
    {"GET", "/api/v1/stations", get_stations, kSee},
    {"GET", "/api/v1/stations/{}", get_station, kSee},
    {"GET", "/api/v1/simulator/{}", get_simulated, kSee},
    {"PUT", "/api/v1/simulator/{}", put_simulated, kChange},
    {"GET", "/api/v1/events", get_events, kSee, "types"},
    {"GET", "/api/v1/relays", get_relays, kSee},
    {"GET", "/api/v1/stations/{}/points", get_points, kSee},
    {"GET", "/api/v1/stations/{}/points/{}", get_point, kSee},
    {"PUT", "/api/v1/stations/{}/points/{}", put_point, kChange, "round"},
    {"GET", "/api/v1/stations/{}/{}/{}/interpretations", get_interpretations, kSee, "count"},
    // Before the tables: "devices" is none of them.
    {"GET", "/api/v1/stations/{}/devices/{}", get_device, kSee, "count type"},
    {"PUT", "/api/v1/stations/{}/devices/{}", put_device, kChange},
    {"GET", "/api/v1/stations/{}/{}/{}", get_table, kSee, "count type"},
    {"PUT", "/api/v1/stations/{}/{}/{}", put_table, kChange},
};

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
        const auto call = [api, handler = row.handler](HttpRequest request) {
            return handler(std::move(request), api.get());
        };
        made.push_back({row.verb, row.pattern, row.needed, call, words_of(row.queries)});
    }
    return made;
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
