#pragma once

#include <cstddef>
#include <cstdint>

#include "panelgate/base/time.hpp"

namespace panelgate::doctor {

struct Settings {
    Duration window = 60s;  ///< length of the window
    Duration step = 5s;     ///< the window moves on by this
    /// Minimum time between looks; a look compares the counters of all stations.
    Duration rest = 500ms;
    /// The window is extended while it has fewer attempts than this.
    std::uint64_t attempts = 20;
    std::size_t marks = 64;  ///< remembered samples at most
};

}  // namespace panelgate::doctor
