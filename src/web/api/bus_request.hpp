#pragma once

#include <cstdint>

#include "panelgate/base/bytes.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// What REST asks of a station (0: of all of a line), or why it may not be transmitted.
Parsed<bus::Request> request_to(std::uint8_t station, Bytes pdu);

}  // namespace panelgate::web
