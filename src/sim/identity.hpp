#pragma once

#include <cstdint>
#include <string_view>

#include "panelgate/base/bytes.hpp"

namespace panelgate::sim {

/// The reply to a well-formed request that touches no memory: 07 (always 0), 08/00, 0B, 11 and
/// 2B/0E with the basic objects (AP 6.7 to 6.9, 6.13, 6.21). Exception 01 for everything else.
/// `events` is what 0B counts: requests answered normally, but for 0B itself.
Bytes identity_reply(std::string_view profile_name, std::uint8_t station, std::uint16_t events,
                     ByteView pdu);

}  // namespace panelgate::sim
