#pragma once

#include "panelgate/web/http/site.hpp"

namespace panelgate::web {

/// Finds the handler and calls it, when the request may. 404 for an unknown path, 405 with Allow
/// for a method the path does not have. HEAD is answered as GET; whoever sends it leaves out the
/// body. The site outlives it.
Handling dispatch(HttpRequest request, const Site* site);

}  // namespace panelgate::web
