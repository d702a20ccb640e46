#include <algorithm>
#include <iterator>

#include "panelgate/web/http/event_hub.hpp"
#include "routes.hpp"
#include "sight.hpp"
#include "target.hpp"

namespace panelgate::web {

namespace {

struct Kind {
    std::string_view type;
    bool names_station;
    bool names_point;
};
constexpr Kind kKinds[] = {{"point", true, true},       {"station", true, false},
                           {"line", false, false},      {"transaction", true, false},
                           {"discovery", false, false}, {"alarm", true, true}};

/// "point, station, line, transaction, discovery and alarm"
std::string known_types() {
    std::string text;
    for (const Kind& kind : kKinds) {
        const bool last = &kind == &kKinds[std::size(kKinds) - 1];
        text += (text.empty() ? "" : last ? " and " : ", ") + std::string(kind.type);
    }
    return text;
}

void add_types(EventFilter& filter, const HttpRequest& request) {
    for (const std::string& type : query_list(request, "types")) {
        if (std::ranges::find(kKinds, type, &Kind::type) == std::end(kKinds))
            refuse(400, "there is no event '" + type + "'; types are " + known_types());
        filter.types.insert(type);
    }
}

/// The station's name in events; an unlisted one is named by its id alone.
std::string name_in_events(const Directory& directory, const StationEntry& station) {
    const bool listed = std::ranges::any_of(
        directory.stations, [&](const StationEntry& one) { return one.name == station.name; });
    return listed ? station.name : std::to_string(station.id);
}

void add_places(EventFilter& filter, const HttpRequest& request, const Directory& directory) {
    for (const std::string& name : query_list(request, "line"))
        filter.lines.insert(find_line(directory, name).value()->name);
    for (const std::string& name : query_list(request, "station")) {
        const StationEntry station = find_station(directory, name).value();
        filter.stations.emplace(station.line, name_in_events(directory, station));
    }
    for (const std::string& name : query_list(request, "point")) {
        const Target found = find_point(directory, name).value();
        filter.points.emplace(found.station.name, found.point->name);
    }
}

/// Refuses a filter that no event can match: a mistake of the client.
void check(const EventFilter& filter) {
    const auto fits = [&](const Kind& kind) {
        const bool wanted = filter.types.empty() || filter.types.contains(std::string(kind.type));
        return wanted && (filter.stations.empty() || kind.names_station) &&
               (filter.points.empty() || kind.names_point);
    };
    if (std::ranges::any_of(kKinds, fits)) return;
    refuse(400, filter.points.empty() ? "no event of these types names a station"
                                      : "only events of the type point name a point");
}

}  // namespace

Handling get_events(HttpRequest request, const Api* api) {
    // The queries types, line, station and point are comma-separated lists.
    EventFilter filter;
    add_types(filter, request);
    add_places(filter, request, *api->directory);
    check(filter);
    filter.may_see = [current = api->current, who = request.caller->who()](
                         const EventTopic& topic) { return Sight(**current, who).event(topic); };
    auto listener =
        api->providers.events->listen(std::move(filter), request.headers["last-event-id"]);
    if (!listener)
        co_return to_response(passing_problem(503, "too many listen to events already", 5));
    HttpResponse response;
    response.content_type = "text/event-stream";
    response.events = std::move(listener);
    co_return response;
}

}  // namespace panelgate::web
