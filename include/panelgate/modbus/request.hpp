#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/span.hpp"

namespace panelgate::modbus {

/// What a request reads and writes; nothing for functions without addresses.
struct Access {
    std::optional<Span> read;
    std::optional<Span> write;
};

/// How strictly quantities are judged before transmission (PDU-08).
enum class QuantityCheck {
    fit,   ///< the reply must fit a 253-byte PDU: what a TCP client can be given
    wide,  ///< REST and polls: up to 255 data bytes, the GT's larger frames
};

/// Is this PDU one that may be transmitted? Function 0 or 128..255: Fault::denied. A length that
/// contradicts the function (PDU-07) or a reply that cannot fit: Fault::malformed.
/// Unknown functions have no length rule and pass. An empty PDU is malformed.
Result<void> check_request(ByteView pdu, QuantityCheck check = QuantityCheck::fit);

/// Which items a checked request touches.
Access access_of(ByteView pdu);
/// What this PDU asks for, when it is a read of a table: 01..04, at least one item, none beyond the
/// end of the table.
std::optional<Span> read_span(ByteView pdu);
/// Repeating it cannot change anything (RTY-02): the reads, and 2B/0E.
bool is_pure_read(ByteView pdu);
/// 08/0004 Force Listen Only Mode: a unicast request that is never answered (DIA-01).
bool is_never_answered(ByteView pdu);

/// Length of the request ADU (address to CRC) that begins here, where its function and byte count
/// tell it: 01 to 06, 0F and 10. 0: nothing tells, or too little is there to tell.
std::size_t request_adu_length(ByteView heard);

/// Length of the normal RTU reply (address to CRC) when the request tells it;
/// 0 for 08/0004; nothing when only the reply tells.
std::optional<std::size_t> reply_length_from_request(ByteView pdu);

Bytes encode_read(Table table, std::uint16_t address, std::uint16_t count);
/// `span` is what read_span() may give.
Bytes encode_read(const Span& span);
Bytes encode_write_coil(std::uint16_t address, bool value);
Bytes encode_write_register(std::uint16_t address, std::uint16_t value);
/// At most 2040 coils (255 data bytes); more breaks the caller's contract.
Bytes encode_write_coils(std::uint16_t address, const std::vector<bool>& values);
/// At most 127 registers.
Bytes encode_write_registers(std::uint16_t address, const std::vector<std::uint16_t>& values);

/// Bits packed least significant first, unused high bits zero (PDU-06).
Bytes pack_bits(const std::vector<bool>& values);

}  // namespace panelgate::modbus
