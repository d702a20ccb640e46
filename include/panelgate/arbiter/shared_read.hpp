#pragma once

#include <cstdint>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/span.hpp"

namespace panelgate::arbiter {

/// What a read of one table (01..04) asks one station for.
struct ReadSpan {
    std::uint8_t station = 0;
    modbus::Span items;

    bool same_table(const ReadSpan& other) const {
        return station == other.station && items.table == other.items.table;
    }
    bool contains(const ReadSpan& other) const {
        return station == other.station && items.contains(other.items);
    }
    friend bool operator==(const ReadSpan&, const ReadSpan&) = default;
};

/// The part of a reply to `whole` that answers `part`, as its own reply PDU. `whole` contains
/// `part` and the reply matches it.
Bytes slice_reply(const modbus::Span& whole, ByteView reply, const modbus::Span& part);

}  // namespace panelgate::arbiter
