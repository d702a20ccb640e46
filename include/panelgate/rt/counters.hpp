#pragma once

#include <cstdint>

#include "panelgate/base/series.hpp"

namespace panelgate::rt {

/// What the shells' common ground counts.
struct Counters {
    std::uint64_t log_lines_dropped = 0;  ///< because stderr's reader stood still
    Histogram loop_lag;                   ///< how late the loop rang its timers (LoopLag)
};

}  // namespace panelgate::rt
