#pragma once

#include <cstdint>
#include <optional>

#include "panelgate/arbiter/queue/read_cache.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::test {

/// What is asked of this station, when it is a read of a table.
inline std::optional<arbiter::ReadSpan> read_span(std::uint8_t station, ByteView pdu) {
    const auto items = modbus::read_span(pdu);
    if (!items) return std::nullopt;
    return arbiter::ReadSpan{station, *items};
}

}  // namespace panelgate::test
