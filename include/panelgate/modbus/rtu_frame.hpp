#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "panelgate/base/bytes.hpp"

namespace panelgate::modbus {

/// The address of requests to all stations: serial line V1.02, 2.2.
inline constexpr std::uint8_t kBroadcast = 0;

/// CRC-16 of the serial line (V1.02, 2.5.1.2): generator 8005h reflected, preset FFFFh, no final
/// XOR. Sent low byte first; over a whole good frame, its CRC included, it is 0.
std::uint16_t crc16(ByteView bytes);
/// Continues a CRC: `before` is the CRC of all preceding bytes.
std::uint16_t crc16(std::uint16_t before, ByteView bytes);

/// Order of the two CRC bytes at the end of a frame.
enum class CrcOrder : std::uint8_t {
    low_first,   ///< the standard's (serial line V1.02, 2.5.1.2)
    high_first,  ///< Autonics GP of before June 2005 (its manual's revision history)
};
/// The words of configuration and profiles.
inline constexpr std::array<std::pair<std::string_view, CrcOrder>, 2> kCrcOrders{
    {{"low_first", CrcOrder::low_first}, {"high_first", CrcOrder::high_first}}};
inline std::string_view label(CrcOrder order) {
    return kCrcOrders[static_cast<std::size_t>(order)].first;
}
inline CrcOrder other(CrcOrder order) {
    return order == CrcOrder::low_first ? CrcOrder::high_first : CrcOrder::low_first;
}

/// CRC order of each address on a line, for sending and receiving; the standard's unless set.
/// Address 0 is the broadcast.
class CrcOrders {
  public:
    void set(std::uint8_t address, CrcOrder order) {
        high_first_[address] = order == CrcOrder::high_first;
    }
    CrcOrder of(std::uint8_t address) const {
        return high_first_[address] ? CrcOrder::high_first : CrcOrder::low_first;
    }

    friend bool operator==(const CrcOrders&, const CrcOrders&) = default;

  private:
    std::bitset<256> high_first_;
};

/// Content of a valid frame of the serial modes (RTU, ASCII).
struct SerialAdu {
    std::uint8_t station = 0;  ///< 0..255; 0 is a broadcast
    Bytes pdu;                 ///< 1 to 253 bytes
    friend bool operator==(const SerialAdu&, const SerialAdu&) = default;
};

inline constexpr std::size_t kCrcSize = 2;
inline constexpr std::size_t kAduOverhead = 1 + kCrcSize;    ///< address and CRC around a PDU
inline constexpr std::size_t kMinAdu = kAduOverhead + 1;     ///< address, function, CRC
inline constexpr std::size_t kExceptionAdu = kMinAdu + 1;    ///< ... and code: the shortest reply
inline constexpr std::size_t kReadRequestAdu = kMinAdu + 4;  ///< 01 to 06: ... and two words
inline constexpr std::size_t kReadReplyOverhead = kMinAdu + 1;  ///< 01 to 04: ... and byte count

/// Returns the PDU, between address and CRC. `adu` has at least kMinAdu bytes.
inline ByteView pdu_of(ByteView adu) { return adu.subspan(1, adu.size() - kAduOverhead); }

/// Encodes address, PDU and CRC, to be sent in one write (TIM-02).
Bytes encode_adu(std::uint8_t station, ByteView pdu, CrcOrder order = CrcOrder::low_first);

/// True for at least address, function and CRC (4 bytes) with a correct CRC. No upper limit.
bool crc_ok(ByteView adu, CrcOrder order = CrcOrder::low_first);
/// Uses the CRC order of the frame's own address.
bool crc_ok(ByteView adu, const CrcOrders& orders);

/// A decoded valid frame. `pdu` points into the bytes it was decoded from.
struct RtuFrame {
    std::uint8_t station = 0;
    ByteView pdu;
};
/// std::nullopt unless crc_ok(adu).
std::optional<RtuFrame> decode_adu(ByteView adu);

}  // namespace panelgate::modbus
