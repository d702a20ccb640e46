#pragma once

#include <cstddef>
#include <cstdint>

namespace panelgate::store {

/// Figures for metrics. `waiting` is bounded by Settings::queue.
struct Counters {
    std::uint64_t written = 0;   ///< writes that are on the disk
    std::uint64_t lost = 0;      ///< writes that the queue or the disk did not take
    std::uint64_t failures = 0;  ///< how often the disk began to take nothing
    std::uint64_t bytes = 0;     ///< of the file
    std::size_t waiting = 0;
    bool failing = false;
};

}  // namespace panelgate::store
