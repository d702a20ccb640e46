#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"

namespace panelgate::sim {

/// What a receiver makes of a line.
struct HeardBytes {
    Bytes bytes;
    /// Bit times from the first start bit to the end of each byte.
    std::vector<std::uint32_t> ends;
};

/// Two senders on one wire, the second `later` bit times after the first: where both speak a 0 of
/// either wins, and the receiver takes its characters from what that gives. Apart they come clean.
HeardBytes collide(ByteView first, ByteView second, std::size_t later, const SerialFormat& format);

}  // namespace panelgate::sim
