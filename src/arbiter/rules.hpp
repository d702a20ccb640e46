#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/shared_read.hpp"

namespace panelgate::arbiter {

inline constexpr std::uint8_t kBroadcast = 0;
inline constexpr std::uint8_t kUnlisted = 0;         ///< in the counters
inline constexpr std::size_t kAduOverhead = 3;       ///< address and CRC
inline constexpr std::size_t kShortestReplyAdu = 5;  ///< an exception

/// This job's items are among those of a transaction.
inline bool contained_in(const std::optional<ReadSpan>& span, const Job& job) {
    if (!span || job.alone) return false;
    const auto own = read_span(job.station, job.pdu);
    return own && span->contains(*own);
}

}  // namespace panelgate::arbiter
