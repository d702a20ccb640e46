#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::modbus {

/// True if this reply PDU answers this request: same function (or its exception, two bytes), byte
/// count equal to the quantity requested, echoed address, value and quantity equal for writes
/// (FRM-04, P1). Functions that this file does not know match by function code alone. With
/// ByteCount::any a reply to 01 to 04 may hold 1 to 251 bytes, as many as Modbus/TCP carries (AP
/// 4.1), if its byte count is that number.
bool answers(ByteView request, ByteView reply, ByteCount byte_count = ByteCount::as_asked);

/// Returns a device's normal reply to a broadcastable write (TBC-03): 05 and 06 echo, 0F and 10
/// return address and quantity. `request` must be one of these.
Bytes normal_write_reply(ByteView request);

/// Returns the registers of a reply to 03, 04 or 17, which must have been matched with answers().
std::vector<std::uint16_t> registers_of(ByteView reply);
/// Returns the first `count` bits of a reply to 01 or 02.
std::vector<bool> bits_of(ByteView reply, std::size_t count);

/// Returns the equivalent request with another function: 05 as 0F with one coil, 06 as 10 with one
/// register; 02 as 01 and 04 as 03, where both show the same memory. std::nullopt for all others,
/// and for an 05 with neither FF00 nor 0000, which has no equivalent.
std::optional<Request> translated(const Request& request);

/// Converts `reply`, a valid reply to translated(asked), to a reply to `asked`: restores the
/// function, also of an exception, and confirms a write as it was requested.
Bytes translated_back(const Bytes& asked, ByteView reply);

}  // namespace panelgate::modbus
