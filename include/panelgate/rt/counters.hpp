#pragma once

#include <cstdint>

namespace panelgate::rt {

/// What the shells' common ground counts.
struct Counters {
    std::uint64_t log_lines_dropped = 0;  ///< because stderr's reader stood still
};

}  // namespace panelgate::rt
