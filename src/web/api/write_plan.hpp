#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/web/http/problem.hpp"
#include "station_path.hpp"

namespace panelgate::web {

inline bool is_writable(modbus::Table table) {
    return table == modbus::Table::coils || table == modbus::Table::holding_registers;
}

/// The PDU that writes these cells from the first of the items on, by the first of the functions
/// below that the panel has; or why the panel cannot take them. Writes are never split.
Parsed<Bytes> plan_write(const Items& items, const std::vector<std::uint16_t>& cells);

/// Functions that can write `count` cells of a table, the preferred one first (one value by 05/06,
/// several by one 0F/10). The table must be coils or holding registers.
std::vector<std::uint8_t> write_functions(modbus::Table table, std::size_t count);

/// The PDU that writes these cells, each 16 bits wide (bits: 0 or 1), with this function: 05, 06,
/// 0F or 10.
Bytes encode_write(std::uint8_t function, std::uint16_t address,
                   const std::vector<std::uint16_t>& cells);

}  // namespace panelgate::web
