#pragma once

#include <cstdint>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/crc_order.hpp"

namespace panelgate::scan {

/// What is kept of one listening at most; the rest is dropped.
inline constexpr std::size_t kMaxHeard = 4096;

struct Frame {
    std::uint8_t station = 0;
    Bytes pdu;
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;
};

struct Heard {
    std::vector<Frame> frames;
    std::size_t damaged = 0;  ///< bytes in no frame
};

/// Good frames, requests as well as replies, wherever they begin, in either order of the CRC. Only
/// functions of the standard: chance makes a frame of noise in less than one of 50 000 places.
Heard take_apart(ByteView bytes);

}  // namespace panelgate::scan
