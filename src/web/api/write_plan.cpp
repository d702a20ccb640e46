#include "write_plan.hpp"

#include <string>

#include "answer.hpp"
#include "panel_limits.hpp"
#include "panelgate/modbus/request.hpp"
#include "refusal.hpp"

namespace panelgate::web {
namespace {

/// With the items that are really written.
Parsed<void> check_area(Items items, std::size_t count) {
    if (items.area == nullptr) return {};
    items.span.count = static_cast<unsigned>(count);
    return check_range(items, *items.area->writable, "writable");
}

}  // namespace

Parsed<Bytes> plan_write(const Items& items, const std::vector<std::uint16_t>& cells) {
    if (cells.size() > modbus::kTableItems - items.span.first) {
        return problem(422, "these values go beyond address 65535");
    }
    const auto range = check_area(items, cells.size());
    if (!range) return range.error();
    const profile::PanelProfile& panel = *items.station.profile;
    const auto functions = write_functions(items.span.table, cells.size());
    for (const std::uint8_t function : functions) {
        if (!panel.has_function(function)) continue;
        const unsigned limit = panel.max_count(function);
        if (cells.size() > limit) {
            return ruled_out(bus::Rule::quantity, "at most " + std::to_string(limit) +
                                                      " values in one write; writes are not split");
        }
        return encode_write(function, items.address(), cells);
    }
    return ruled_out(bus::Rule::function, "the panel has no function " +
                                              upper_hex({&functions.back(), 1}) + " for " +
                                              std::to_string(cells.size()) + " of its " +
                                              std::string(label(items.span.table)));
}

std::vector<std::uint8_t> write_functions(modbus::Table table, std::size_t count) {
    const bool bits = modbus::is_bit_table(table);
    std::vector<std::uint8_t> functions;
    if (count == 1) {
        functions.push_back(bits ? modbus::kWriteSingleCoil : modbus::kWriteSingleRegister);
    }
    functions.push_back(bits ? modbus::kWriteMultipleCoils : modbus::kWriteMultipleRegisters);
    return functions;
}

Bytes encode_write(std::uint8_t function, std::uint16_t address,
                   const std::vector<std::uint16_t>& cells) {
    if (function == modbus::kWriteSingleCoil) {
        return modbus::encode_write_coil(address, cells.front() != 0);
    }
    if (function == modbus::kWriteSingleRegister) {
        return modbus::encode_write_register(address, cells.front());
    }
    if (function == modbus::kWriteMultipleCoils) {
        return modbus::encode_write_coils(address, std::vector<bool>(cells.begin(), cells.end()));
    }
    return modbus::encode_write_registers(address, cells);
}

}  // namespace panelgate::web
