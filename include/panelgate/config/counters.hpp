#pragma once

#include <array>
#include <cstdint>

#include "panelgate/base/words.hpp"

namespace panelgate::config {

/// Counters of configuration reloads.
struct ReloadCounters {
    std::array<std::uint64_t, kReloadOutcomes.size()> reloads{};  ///< by outcome
    double last_success_unix = 0;  ///< seconds; the start counts as one
    bool last_succeeded = true;    ///< the running configuration is that of the last read
};

}  // namespace panelgate::config
