#pragma once

#include <cstdint>

#include "panelgate/base/series.hpp"

namespace panelgate::rt {

/// Counters of the runtime.
struct Counters {
    std::uint64_t log_lines_dropped = 0;  ///< because stderr was not read
    Histogram loop_lag;                   ///< how late the loop fired its timers (LoopLag)
};

}  // namespace panelgate::rt
