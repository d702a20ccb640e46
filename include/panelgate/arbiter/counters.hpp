#pragma once

#include <array>
#include <cstdint>
#include <map>

#include "panelgate/base/histogram.hpp"

namespace panelgate::arbiter {

/// What happened on the wire, by station. Counted by the arbiter, read by metrics/ (contract 6).
struct StationCounters {
    std::uint64_t retries = 0;
    std::uint64_t late_frames = 0;     ///< good frames that answer a request already closed
    std::uint64_t foreign_frames = 0;  ///< good frames of another station, or nobody's reply
    std::uint64_t damaged_frames = 0;  ///< bytes that never became a good frame
    std::uint64_t discarded_bytes = 0;
    std::uint64_t echo_mismatches = 0;  ///< collisions: the echo was not what was sent
    std::map<std::uint8_t, std::uint64_t> exceptions;  ///< by code: at most 256
    Histogram bus_transaction;                         ///< first bit out to last bit in
    Histogram turnaround;                              ///< the panel's own think time
};

enum class PriorityClass : std::uint8_t { write, read, poll, probe };
inline constexpr std::size_t kPriorityClasses = 4;

struct LineCounters {
    std::uint64_t broadcasts = 0;
    Duration busy{};  ///< request, both gaps, think time, reply: what nobody else could use
    std::array<Histogram, kPriorityClasses> queue_wait;
};

}  // namespace panelgate::arbiter
