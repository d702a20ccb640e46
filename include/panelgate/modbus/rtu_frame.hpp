#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/crc_order.hpp"

namespace panelgate::modbus {

inline constexpr std::size_t kCrcSize = 2;
inline constexpr std::size_t kAduOverhead = 1 + kCrcSize;    ///< address and CRC around a PDU
inline constexpr std::size_t kMinAdu = kAduOverhead + 1;     ///< address, function, CRC
inline constexpr std::size_t kExceptionAdu = kMinAdu + 1;    ///< ... and code: the shortest reply
inline constexpr std::size_t kReadRequestAdu = kMinAdu + 4;  ///< 01 to 06: ... and two words
inline constexpr std::size_t kReadReplyOverhead = kMinAdu + 1;  ///< 01 to 04: ... and byte count

/// What stands between the address and the CRC. At least kMinAdu bytes.
inline ByteView pdu_of(ByteView adu) { return adu.subspan(1, adu.size() - kAduOverhead); }

/// Address, PDU, CRC: what goes out in one write (TIM-02).
Bytes encode_adu(std::uint8_t station, ByteView pdu, CrcOrder order = CrcOrder::low_first);

/// At least address, function and CRC (4 bytes), and the CRC is right. Knows no upper limit.
bool crc_ok(ByteView adu, CrcOrder order = CrcOrder::low_first);
/// ... in the order of the frame's own address.
bool crc_ok(ByteView adu, const CrcOrders& orders);

/// A good frame taken apart. `pdu` looks into the bytes it was made from.
struct RtuFrame {
    std::uint8_t station = 0;
    ByteView pdu;
};
/// Nothing unless crc_ok(adu).
std::optional<RtuFrame> decode_adu(ByteView adu);

}  // namespace panelgate::modbus
