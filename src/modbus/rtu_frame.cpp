#include "panelgate/modbus/rtu_frame.hpp"

#include <cstddef>

#include "panelgate/modbus/crc16.hpp"

namespace panelgate::modbus {
namespace {

constexpr std::size_t kMinAdu = 4;  // address, function, CRC
constexpr std::size_t kCrcSize = 2;

}  // namespace

Bytes encode_adu(std::uint8_t station, ByteView pdu) {
    Bytes adu;
    adu.reserve(1 + pdu.size() + kCrcSize);
    adu.push_back(station);
    adu.insert(adu.end(), pdu.begin(), pdu.end());
    const std::uint16_t crc = crc16(adu);
    adu.push_back(static_cast<std::uint8_t>(crc & 0xFF));
    adu.push_back(static_cast<std::uint8_t>(crc >> 8));
    return adu;
}

bool crc_ok(ByteView adu) { return adu.size() >= kMinAdu && crc16(adu) == 0; }

std::optional<RtuFrame> decode_adu(ByteView adu) {
    if (!crc_ok(adu)) return std::nullopt;
    return RtuFrame{adu[0], adu.subspan(1, adu.size() - 1 - kCrcSize)};
}

}  // namespace panelgate::modbus
