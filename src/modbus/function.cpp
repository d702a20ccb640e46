#include "panelgate/modbus/function.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

namespace panelgate::modbus {

std::string_view label(Table table) {
    switch (table) {
        case Table::coils:
            return "coils";
        case Table::discrete_inputs:
            return "discrete-inputs";
        case Table::input_registers:
            return "input-registers";
        case Table::holding_registers:
            return "holding-registers";
    }
    std::abort();
}

Function read_function(Table table) {
    switch (table) {
        case Table::coils:
            return kReadCoils;
        case Table::discrete_inputs:
            return kReadDiscreteInputs;
        case Table::input_registers:
            return kReadInputRegisters;
        case Table::holding_registers:
            return kReadHoldingRegisters;
    }
    std::abort();
}

bool is_read(std::uint8_t function) {
    switch (function) {
        case kReadCoils:
        case kReadDiscreteInputs:
        case kReadHoldingRegisters:
        case kReadInputRegisters:
        case kReadExceptionStatus:
        case kGetCommEventCounter:
        case kGetCommEventLog:
        case kReportServerId:
        case kReadFileRecord:
        case kReadFifoQueue:
            return true;
        default:
            return false;
    }
}

bool is_broadcastable(std::uint8_t function) {
    switch (function) {
        case kWriteSingleCoil:
        case kWriteSingleRegister:
        case kWriteMultipleCoils:
        case kWriteMultipleRegisters:
            return true;
        default:
            return false;
    }
}

namespace {

struct NamedFunction {
    Function code;
    std::string_view name;
};
constexpr std::array kNamed = {
    NamedFunction{kReadCoils, "read coils"},
    NamedFunction{kReadDiscreteInputs, "read discrete inputs"},
    NamedFunction{kReadHoldingRegisters, "read holding registers"},
    NamedFunction{kReadInputRegisters, "read input registers"},
    NamedFunction{kWriteSingleCoil, "write single coil"},
    NamedFunction{kWriteSingleRegister, "write single register"},
    NamedFunction{kReadExceptionStatus, "read exception status"},
    NamedFunction{kDiagnostics, "diagnostics"},
    NamedFunction{kGetCommEventCounter, "get comm event counter"},
    NamedFunction{kGetCommEventLog, "get comm event log"},
    NamedFunction{kWriteMultipleCoils, "write multiple coils"},
    NamedFunction{kWriteMultipleRegisters, "write multiple registers"},
    NamedFunction{kReportServerId, "report server id"},
    NamedFunction{kReadFileRecord, "read file record"},
    NamedFunction{kWriteFileRecord, "write file record"},
    NamedFunction{kMaskWriteRegister, "mask write register"},
    NamedFunction{kReadWriteMultipleRegisters, "read/write multiple registers"},
    NamedFunction{kReadFifoQueue, "read fifo queue"},
    NamedFunction{kEncapsulatedInterface, "encapsulated interface"},
};

}  // namespace

std::string_view function_name(std::uint8_t function) {
    const auto* const found = std::ranges::find(kNamed, function, &NamedFunction::code);
    return found == kNamed.end() ? std::string_view() : found->name;
}

bool is_known(std::uint8_t function) { return !function_name(function).empty(); }

}  // namespace panelgate::modbus
