#pragma once

#include <cstdint>
#include <optional>

#include "panelgate/base/bytes.hpp"

namespace panelgate::arbiter {

/// The items [address, address + count) that a function 01..04 asks one station for.
struct ReadSpan {
    std::uint8_t station = 0;
    std::uint8_t function = 0;
    std::uint32_t address = 0;
    std::uint32_t count = 0;

    std::uint32_t end() const { return address + count; }
    bool same_table(const ReadSpan& other) const {
        return station == other.station && function == other.function;
    }
    bool contains(const ReadSpan& other) const {
        return same_table(other) && address <= other.address && other.end() <= end();
    }
    /// They overlap or lie side by side: together they are one span without a hole.
    bool touches(const ReadSpan& other) const {
        return same_table(other) && other.address <= end() && address <= other.end();
    }
    bool reads_bits() const { return function <= 2; }
    friend bool operator==(const ReadSpan&, const ReadSpan&) = default;
};

/// What this request asks for, when it is a read that can be shared: 01..04, at least one item, no
/// end beyond 65536.
std::optional<ReadSpan> read_span(std::uint8_t station, ByteView pdu);
/// Both together; they touch.
ReadSpan join(const ReadSpan& a, const ReadSpan& b);
Bytes encode_span(const ReadSpan& span);
/// The part of a reply to `whole` that answers `part`, as its own reply PDU. `whole` contains
/// `part` and the reply matches it.
Bytes slice_reply(const ReadSpan& whole, ByteView reply, const ReadSpan& part);

}  // namespace panelgate::arbiter
