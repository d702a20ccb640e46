#pragma once

#include "api/handlers.hpp"

namespace panelgate::web {

/// Finds the handler and calls it, when the request may. 404 for an unknown path, 405 with Allow
/// for a method the path does not have. HEAD is answered as GET; whoever sends it leaves out the
/// body.
Handling dispatch(HttpRequest request, const Api* api);

}  // namespace panelgate::web
