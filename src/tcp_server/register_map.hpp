#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "own_unit.hpp"

namespace panelgate::tcp_server {

/// The gateway's own register map, the same for input and holding registers, with a discrete input
/// per unit. Every address below these is readable; unassigned ones are 0. describe_register_map()
/// (panelgate/tcp_server/register_map_text.hpp) documents it.
inline constexpr std::size_t kMapRegisters = 5000;
inline constexpr std::size_t kMapInputs = 256;

/// The registers and inputs, computed from `state`; unassigned addresses read 0.
class RegisterMap {
  public:
    /// `state` must outlive it.
    explicit RegisterMap(const Diagnostics& state) : state_(state) {}
    std::uint16_t at(std::size_t address);
    /// True if the station behind this unit is online.
    bool input(std::size_t unit);

  private:
    std::uint16_t of_gateway(std::size_t address) const;
    std::uint16_t fixed(std::size_t address) const;
    std::uint16_t of_station(std::size_t offset) const;
    void look_at(std::size_t unit);

    const Diagnostics& state_;
    std::optional<std::size_t> unit_;  ///< unit of `station_`
    std::optional<Diagnostics::Station> station_;
};

}  // namespace panelgate::tcp_server
