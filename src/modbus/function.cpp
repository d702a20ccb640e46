#include "panelgate/modbus/function.hpp"

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

std::string_view function_name(std::uint8_t function) {
    switch (function) {
        case kReadCoils:
            return "read coils";
        case kReadDiscreteInputs:
            return "read discrete inputs";
        case kReadHoldingRegisters:
            return "read holding registers";
        case kReadInputRegisters:
            return "read input registers";
        case kWriteSingleCoil:
            return "write single coil";
        case kWriteSingleRegister:
            return "write single register";
        case kReadExceptionStatus:
            return "read exception status";
        case kDiagnostics:
            return "diagnostics";
        case kGetCommEventCounter:
            return "get comm event counter";
        case kGetCommEventLog:
            return "get comm event log";
        case kWriteMultipleCoils:
            return "write multiple coils";
        case kWriteMultipleRegisters:
            return "write multiple registers";
        case kReportServerId:
            return "report server id";
        case kReadFileRecord:
            return "read file record";
        case kWriteFileRecord:
            return "write file record";
        case kMaskWriteRegister:
            return "mask write register";
        case kReadWriteMultipleRegisters:
            return "read/write multiple registers";
        case kReadFifoQueue:
            return "read fifo queue";
        case kEncapsulatedInterface:
            return "encapsulated interface";
        default:
            return "";
    }
}

bool is_known(std::uint8_t function) { return !function_name(function).empty(); }

}  // namespace panelgate::modbus
