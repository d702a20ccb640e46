#pragma once

#include <optional>

#include "panelgate/web/http/problem.hpp"
#include "panelgate/web/http/site.hpp"
#include "shared.hpp"

namespace panelgate::web {

/// Finds the handler and calls it, when the request may. 404 for an unknown path, 405 with Allow
/// for a method the path does not have. HEAD is answered as GET; whoever sends it leaves out the
/// body. `barred` is the answer to everything but probes. `shared` outlives it, and the site
/// as long as the caller has not left.
Handling dispatch(HttpRequest request, Shared* shared, std::optional<Problem> barred = {});

}  // namespace panelgate::web
