#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

inline constexpr std::uint8_t kBroadcast = 0;
inline constexpr std::uint8_t kUnlisted = 0;  ///< key in the counters

/// True if the bytes begin with another master's request: not our own frame, which an adapter
/// configured without echo may return. The reply framer would take a request followed by its reply
/// for damage.
inline bool begins_with_request(ByteView heard, ByteView own, const modbus::CrcOrders& orders) {
    const std::size_t size = modbus::request_adu_length(heard);
    return size != 0 && size <= heard.size() && modbus::crc_ok(heard.first(size), orders) &&
           !std::ranges::equal(heard.first(size), own);
}

/// True if this job's items are among those of a transaction with its station.
inline bool contained_in(const std::optional<modbus::Span>& span, const Job& job) {
    if (!span || job.alone) return false;
    const auto& own = job.request.span();
    return own && span->contains(*own);
}

}  // namespace panelgate::arbiter
