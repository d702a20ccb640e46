#include "panelgate/modbus/crc16.hpp"

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

}  // namespace panelgate::modbus
