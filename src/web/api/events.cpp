#include <utility>

#include "event_filter.hpp"
#include "handlers.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

Handling get_events(HttpRequest request, const Api* api) {
    auto filter = event_filter_of(request, *api->directory);
    if (!filter) co_return to_response(filter.error());
    auto listener =
        api->providers.events->listen(std::move(*filter), request.headers["last-event-id"]);
    if (!listener)
        co_return to_response(passing_problem(503, "too many listen to events already", 5));
    HttpResponse response;
    response.content_type = "text/event-stream";
    response.events = std::move(listener);
    co_return response;
}

}  // namespace panelgate::web
