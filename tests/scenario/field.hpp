#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "plan.hpp"

namespace panelgate::scenario {

/// All defaults, and so many plain panels with the ids 1, 2, 3…
Plan quiet_line(int baud, unsigned panels, Duration think = 5ms);
ClientPlan& add_client(Plan& plan, std::vector<std::uint8_t> stations, double writes = 0);
/// The first of ten seeds that breaks a promise, and how; nothing when none does.
std::string broken(Plan plan);

}  // namespace panelgate::scenario
