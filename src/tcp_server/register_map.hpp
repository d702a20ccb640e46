#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "own_unit.hpp"

namespace panelgate::tcp_server {

/// The gateway's own memory, the same for input and holding registers, and a discrete input for
/// each unit. Every address below these can be read; what nothing stands at is 0.
/// describe_register_map() (panelgate/tcp_server/register_map_text.hpp) says what stands where.
inline constexpr std::size_t kMapRegisters = 5000;
inline constexpr std::size_t kMapInputs = 256;

/// Register `address`; 0 where nothing stands.
class RegisterMap {
  public:
    /// `state` outlives it.
    explicit RegisterMap(const Diagnostics& state) : state_(state) {}
    std::uint16_t at(std::size_t address);
    /// Does the station behind this unit answer?
    bool input(std::size_t unit);

  private:
    std::uint16_t of_gateway(std::size_t address) const;
    std::uint16_t fixed(std::size_t address) const;
    std::uint16_t of_station(std::size_t offset) const;
    void look_at(std::size_t unit);

    const Diagnostics& state_;
    std::optional<std::size_t> unit_;  ///< that `station_` is of
    std::optional<Diagnostics::Station> station_;
};

}  // namespace panelgate::tcp_server
