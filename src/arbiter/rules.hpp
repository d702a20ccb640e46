#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/shared_read.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

inline constexpr std::uint8_t kBroadcast = 0;
inline constexpr std::uint8_t kUnlisted = 0;         ///< in the counters
inline constexpr std::size_t kAduOverhead = 3;       ///< address and CRC
inline constexpr std::size_t kShortestReplyAdu = 5;  ///< an exception

/// These bytes begin with another master's request: not our own frame, which an adapter that is
/// said to have no echo may give. What is heard is cut into replies elsewhere, and a request glued
/// to its reply would pass for damage.
inline bool begins_with_request(ByteView heard, ByteView own) {
    const std::size_t size = modbus::request_adu_length(heard);
    return size != 0 && size <= heard.size() && modbus::crc_ok(heard.first(size)) &&
           !std::ranges::equal(heard.first(size), own);
}

/// This job's items are among those of a transaction.
inline bool contained_in(const std::optional<ReadSpan>& span, const Job& job) {
    if (!span || job.alone) return false;
    const auto own = read_span(job.station, job.pdu);
    return own && span->contains(*own);
}

}  // namespace panelgate::arbiter
