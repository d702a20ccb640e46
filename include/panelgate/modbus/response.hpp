#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::modbus {

/// Does this reply PDU answer this request? Same function (or its exception, two bytes), byte count
/// equal to the quantity asked, echoed address, value and quantity equal for writes (FRM-04, P1).
/// Functions that this file does not know match by function code alone.
bool answers(ByteView request, ByteView reply);

/// The normal reply that a device would give to a broadcastable write (TBC-03): 05 and 06 echo, 0F
/// and 10 give address and quantity. `request` must be one of these.
Bytes normal_write_reply(ByteView request);

/// Registers of a reply to 03, 04 or 17; the reply must have been matched with answers().
std::vector<std::uint16_t> registers_of(ByteView reply);
/// The first `count` bits of a reply to 01 or 02.
std::vector<bool> bits_of(ByteView reply, std::size_t count);

/// The request that does the same by another function: 05 by 0F with one coil, 06 by 10 with one
/// register; 02 by 01 and 04 by 03, where both show one memory. Nothing for all others, and for an
/// 05 that says neither FF00 nor 0000: no other function says that.
std::optional<Request> translated(const Request& request);

/// What `reply`, a good one to translated(asked), is to whoever asked so: the function is its own
/// again, of an exception too, and a write is confirmed as it was asked.
Bytes translated_back(const Bytes& asked, ByteView reply);

}  // namespace panelgate::modbus
