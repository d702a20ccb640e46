#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"

namespace panelgate::modbus {

/// Exception codes of AP section 7. Any other byte is a vendor's own and passes through unchanged.
enum class ExceptionCode : std::uint8_t {
    illegal_function = 0x01,
    illegal_data_address = 0x02,
    illegal_data_value = 0x03,
    server_device_failure = 0x04,
    acknowledge = 0x05,
    server_device_busy = 0x06,
    memory_parity_error = 0x08,
    gateway_path_unavailable = 0x0A,
    gateway_target_failed = 0x0B,
};

/// "illegal data address"; "exception 9" for codes without a name.
std::string describe_exception(std::uint8_t code);

/// What a client is told: 01 denied; 03 malformed; 06 busy, expired; 0A not routed, line down,
/// cancelled (the gateway is stopping); 0B for all that may have happened or a silent station.
ExceptionCode to_exception(Fault fault);

/// {function | 80h, code}
Bytes encode_exception(std::uint8_t function, ExceptionCode code);
/// The code, when `pdu` is an exception reply (two bytes, high bit set).
std::optional<std::uint8_t> exception_of(ByteView pdu);

}  // namespace panelgate::modbus
