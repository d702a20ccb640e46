#pragma once

#include <cstdint>
#include <optional>

#include "panelgate/base/bytes.hpp"

namespace panelgate::modbus {

/// Address, PDU, CRC low byte first: what goes out in one write (TIM-02).
Bytes encode_adu(std::uint8_t station, ByteView pdu);

/// At least address, function and CRC (4 bytes), and the CRC is right. Knows no upper limit.
bool crc_ok(ByteView adu);

/// A good frame taken apart. `pdu` looks into the bytes it was made from.
struct RtuFrame {
    std::uint8_t station = 0;
    ByteView pdu;
};
/// Nothing unless crc_ok(adu).
std::optional<RtuFrame> decode_adu(ByteView adu);

}  // namespace panelgate::modbus
