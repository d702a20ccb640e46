#pragma once

#include <cstdint>
#include <vector>

#include "items.hpp"

namespace panelgate::web {

/// The PDU that writes these cells, each 16 bits wide (bits: 0 or 1), with this function: 05, 06,
/// 0F or 10.
Bytes encode_write(std::uint8_t function, std::uint16_t address,
                   const std::vector<std::uint16_t>& cells);

/// Functions that can write `count` cells of a table, the preferred one first (one value by 05/06,
/// several by one 0F/10). The table must be coils or holding registers.
std::vector<std::uint8_t> write_functions(modbus::Table table, std::size_t count);
bool is_writable(modbus::Table table);

}  // namespace panelgate::web
