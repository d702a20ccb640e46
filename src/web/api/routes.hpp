#pragma once

#include <boost/json/array.hpp>
#include <memory>
#include <vector>

#include "handlers.hpp"
#include "panelgate/web/http/site.hpp"

namespace panelgate::web {

/// Every path of the contract's section 5. The handlers share the API.
std::vector<Route> routes(std::shared_ptr<const Api> api);
/// What each path may be asked, and by whom, for people: method, path, role.
boost::json::array offered();
/// Those that need no bus: probes, and the faults of simulated panels.
std::vector<Route> simulator_routes(std::shared_ptr<const Api> api);

}  // namespace panelgate::web
