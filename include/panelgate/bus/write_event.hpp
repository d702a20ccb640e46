#pragma once

#include <cstdint>
#include <optional>

#include "panelgate/modbus/span.hpp"

namespace panelgate::bus {

/// Somebody writes, whoever it is: what is known of these items is old from now on. Told when the
/// request leaves and when its attempt is over, before it is answered.
struct WriteEvent {
    std::uint8_t station = 0;           ///< 0: all of the line
    std::optional<modbus::Span> items;  ///< nothing: it may change anything
    bool ended = false;
    std::uint64_t client = 0;  ///< whose it is (ClientId); 0: nobody waits for it any more
};

}  // namespace panelgate::bus
