#pragma once

#include <cstdint>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// What a client is told of a request that the rights on a line forbid.
Problem problem_of(const bus::Refusal& refusal);
/// Would the bus take a write to this station, or (0) to everybody on its line? 403 when it would
/// not, before anything else is said of the request.
Parsed<void> check_may_write(const bus::BusClient& bus, std::uint8_t station);

}  // namespace panelgate::web
