#include "api/write_plan.hpp"

#include "panelgate/modbus/request.hpp"

namespace panelgate::web {

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

std::vector<std::uint8_t> write_functions(modbus::Table table, std::size_t count) {
    const bool bits = modbus::is_bit_table(table);
    std::vector<std::uint8_t> functions;
    if (count == 1) {
        functions.push_back(bits ? modbus::kWriteSingleCoil : modbus::kWriteSingleRegister);
    }
    functions.push_back(bits ? modbus::kWriteMultipleCoils : modbus::kWriteMultipleRegisters);
    return functions;
}

bool is_writable(modbus::Table table) {
    return table == modbus::Table::coils || table == modbus::Table::holding_registers;
}

}  // namespace panelgate::web
