#pragma once

#include <cstdint>

#include "panelgate/base/bytes.hpp"

namespace panelgate::modbus {

/// What a good frame of the serial modes (RTU, ASCII) says.
struct SerialAdu {
    std::uint8_t station = 0;  ///< 0..255; 0 is a broadcast
    Bytes pdu;                 ///< 1 to 253 bytes
    friend bool operator==(const SerialAdu&, const SerialAdu&) = default;
};

}  // namespace panelgate::modbus
