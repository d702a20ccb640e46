#pragma once

#include <optional>

#include "panelgate/web/http/problem.hpp"
#include "panelgate/web/http/site.hpp"

namespace panelgate::web {

/// Finds the handler and calls it, when the request may. 404 for an unknown path, 405 with Allow
/// for a method the path does not have. HEAD is answered as GET; whoever sends it leaves out the
/// body. `barred` is the answer to everything but what is free. The site outlives it.
Handling dispatch(HttpRequest request, const Site* site, std::optional<Problem> barred = {});

}  // namespace panelgate::web
