#include "panelgate/modbus/rtu_frame.hpp"

#include "panelgate/modbus/crc16.hpp"

namespace panelgate::modbus {

Bytes encode_adu(std::uint8_t station, ByteView pdu, CrcOrder order) {
    Bytes adu;
    adu.reserve(pdu.size() + kAduOverhead);
    adu.push_back(station);
    adu.insert(adu.end(), pdu.begin(), pdu.end());
    const std::uint16_t crc = crc16(adu);
    const auto low = static_cast<std::uint8_t>(crc & 0xFF);
    const auto high = static_cast<std::uint8_t>(crc >> 8);
    adu.push_back(order == CrcOrder::low_first ? low : high);
    adu.push_back(order == CrcOrder::low_first ? high : low);
    return adu;
}

bool crc_ok(ByteView adu, CrcOrder order) {
    if (adu.size() < kMinAdu) return false;
    if (order == CrcOrder::low_first) return crc16(adu) == 0;
    const std::size_t end = adu.size() - kCrcSize;
    return crc16(adu.first(end)) == (adu[end] << 8 | adu[end + 1]);
}

bool crc_ok(ByteView adu, const CrcOrders& orders) {
    return !adu.empty() && crc_ok(adu, orders.of(adu[0]));
}

std::optional<RtuFrame> decode_adu(ByteView adu) {
    if (!crc_ok(adu)) return std::nullopt;
    return RtuFrame{adu[0], pdu_of(adu)};
}

}  // namespace panelgate::modbus
