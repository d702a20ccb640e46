#pragma once

#include "diagnostics.hpp"
#include "panelgate/base/bytes.hpp"

namespace panelgate::tcp_server {

/// The reply to 2B/0E (AP 6.21), stream and individual access: basic (vendor, product code,
/// version), regular (URL, product, model, machine) and extended objects (80 + i: the name of line
/// i). `request` is a PDU of four bytes. What does not fit one reply follows in the next.
Bytes identify(ByteView request, const Diagnostics& state);

}  // namespace panelgate::tcp_server
