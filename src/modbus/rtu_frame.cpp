#include "panelgate/modbus/rtu_frame.hpp"

#include "panelgate/modbus/crc16.hpp"

namespace panelgate::modbus {

Bytes encode_adu(std::uint8_t station, ByteView pdu) {
    Bytes adu;
    adu.reserve(pdu.size() + kAduOverhead);
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
    return RtuFrame{adu[0], adu.subspan(1, adu.size() - kAduOverhead)};
}

}  // namespace panelgate::modbus
