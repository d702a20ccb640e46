#pragma once

#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::modbus {

/// The request that does the same by another function: 05 by 0F with one coil, 06 by 10 with one
/// register; 02 by 01 and 04 by 03, where both show one memory. Nothing for all others, and for an
/// 05 that says neither FF00 nor 0000: no other function says that.
std::optional<Request> translated(const Request& request);

/// What `reply`, a good one to translated(asked), is to whoever asked so: the function is its own
/// again, of an exception too, and a write is confirmed as it was asked.
Bytes translated_back(const Bytes& asked, ByteView reply);

}  // namespace panelgate::modbus
