#include "panelgate/modbus/rtu_frame.hpp"

#include <array>
#include <cstddef>

namespace panelgate::modbus {

namespace {

constexpr std::uint16_t kReflectedGenerator = 0xA001;

constexpr std::array<std::uint16_t, 256> make_table() {
    std::array<std::uint16_t, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i) {
        auto value = static_cast<unsigned>(i);
        for (int bit = 0; bit < 8; ++bit) {
            value = (value & 1) != 0 ? value >> 1 ^ kReflectedGenerator : value >> 1;
        }
        table[i] = static_cast<std::uint16_t>(value);
    }
    return table;
}

constexpr auto kTable = make_table();
static_assert(kTable[1] == 0xC0C1);

}  // namespace

std::uint16_t crc16(ByteView bytes) { return crc16(0xFFFF, bytes); }

std::uint16_t crc16(std::uint16_t before, ByteView bytes) {
    unsigned crc = before;
    for (const std::uint8_t byte : bytes) crc = crc >> 8 ^ kTable[(crc ^ byte) & 0xFF];
    return static_cast<std::uint16_t>(crc);
}

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
