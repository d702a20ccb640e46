#pragma once

#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// Which events a request wants: from the queries types, line, station and point, each a list with
/// commas. 400 for a type that there is not, and where no event of the types could name what is
/// asked for; 404 for a line, station or point that there is not.
Parsed<EventFilter> event_filter_of(const HttpRequest& request, const Directory& directory);

}  // namespace panelgate::web
