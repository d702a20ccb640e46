#pragma once

#include <cstdint>
#include <string>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// What a client is told of a request that is refused here: 403 by access, 422 by a guard. The
/// member "rule" is label(Rule).
Problem problem_of(const bus::Refusal& refusal);
/// 422 of what the profile rules out before it is a request: nothing was sent.
Problem ruled_out(bus::Rule rule, std::string detail);
/// Would the bus take a write to this station, or (0) to everybody on its line? 403 when it would
/// not, before anything else is said of the request.
Parsed<void> check_may_write(const bus::BusClient& bus, std::uint8_t station);

}  // namespace panelgate::web
