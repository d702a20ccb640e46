#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

namespace panelgate::modbus {

/// How the two bytes of the CRC stand at the end of a frame.
enum class CrcOrder : std::uint8_t {
    low_first,   ///< the standard's (serial line V1.02, 2.5.1.2)
    high_first,  ///< Autonics GP of before June 2005 (its manual's revision history)
};
/// As the configuration and the profiles write them.
inline constexpr std::array<std::pair<std::string_view, CrcOrder>, 2> kCrcOrders{
    {{"low_first", CrcOrder::low_first}, {"high_first", CrcOrder::high_first}}};
inline std::string_view label(CrcOrder order) {
    return kCrcOrders[static_cast<std::size_t>(order)].first;
}
inline CrcOrder other(CrcOrder order) {
    return order == CrcOrder::low_first ? CrcOrder::high_first : CrcOrder::low_first;
}

/// Which order each address of a line sends and expects; the standard's unless set. Address 0 is
/// the broadcast.
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

}  // namespace panelgate::modbus
