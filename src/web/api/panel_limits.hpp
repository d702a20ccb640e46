#pragma once

#include <string_view>

#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/http/problem.hpp"
#include "station_path.hpp"

namespace panelgate::web {

/// May these items of an area be used? 422 that names the range. `what` is "readable", …
Parsed<void> check_range(const Items& items, const profile::AddressRange& range,
                         std::string_view what);

/// The first table, the area's own or another that reaches it, whose read function the panel has.
/// A table path is taken at its word: what the panel makes of it, its exception tells.
Parsed<modbus::Table> table_to_read(const Items& items);

}  // namespace panelgate::web
