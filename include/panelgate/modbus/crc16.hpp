#pragma once

#include <cstdint>

#include "panelgate/base/bytes.hpp"

namespace panelgate::modbus {

/// CRC-16 of the serial line (V1.02, 2.5.1.2): generator 8005h reflected, preset FFFFh, no final
/// XOR. Sent low byte first; over a whole good frame, its CRC included, it is 0.
std::uint16_t crc16(ByteView bytes);
/// ... of bytes that go on where `before` is that of all before them.
std::uint16_t crc16(std::uint16_t before, ByteView bytes);

}  // namespace panelgate::modbus
