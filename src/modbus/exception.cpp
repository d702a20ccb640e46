#include "panelgate/modbus/exception.hpp"

#include <cstdlib>

#include "panelgate/modbus/function.hpp"

namespace panelgate::modbus {

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
