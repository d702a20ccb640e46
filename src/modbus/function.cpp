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

std::string describe_exception(std::uint8_t code) {
    switch (static_cast<ExceptionCode>(code)) {
        case ExceptionCode::illegal_function:
            return "illegal function";
        case ExceptionCode::illegal_data_address:
            return "illegal data address";
        case ExceptionCode::illegal_data_value:
            return "illegal data value";
        case ExceptionCode::server_device_failure:
            return "server device failure";
        case ExceptionCode::acknowledge:
            return "acknowledge";
        case ExceptionCode::server_device_busy:
            return "server device busy";
        case ExceptionCode::memory_parity_error:
            return "memory parity error";
        case ExceptionCode::gateway_path_unavailable:
            return "gateway path unavailable";
        case ExceptionCode::gateway_target_failed:
            return "gateway target device failed to respond";
    }
    return "exception " + std::to_string(code);
}

ExceptionCode to_exception(Fault fault) {
    switch (fault) {
        case Fault::denied:
            return ExceptionCode::illegal_function;
        case Fault::malformed:
            return ExceptionCode::illegal_data_value;
        case Fault::busy:
        case Fault::expired:
            return ExceptionCode::server_device_busy;
        case Fault::not_routed:
        case Fault::line_down:
        case Fault::cancelled:
            return ExceptionCode::gateway_path_unavailable;
        case Fault::line_lost:
        case Fault::timeout:
        case Fault::damaged:
        case Fault::wrong:
        case Fault::offline:
            return ExceptionCode::gateway_target_failed;
    }
    std::abort();
}

Bytes encode_exception(std::uint8_t function, ExceptionCode code) {
    Writer out;
    out.u8(function | kExceptionBit).u8(static_cast<std::uint8_t>(code));
    return out.take();
}

std::optional<std::uint8_t> exception_of(ByteView pdu) {
    if (pdu.size() != 2 || (pdu[0] & kExceptionBit) == 0) return std::nullopt;
    return pdu[1];
}

}  // namespace panelgate::modbus
