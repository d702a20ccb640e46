#pragma once

#include <array>
#include <cstdint>

#include "panelgate/base/words.hpp"

namespace panelgate::config {

/// Of a gateway that may read its file again.
struct ReloadCounters {
    std::array<std::uint64_t, kReloadOutcomes.size()> reloads{};  ///< by outcome
    double last_success_unix = 0;                                 ///< seconds; the start counts
    bool last_succeeded = true;  ///< what runs is what the file said when it was read last
};

}  // namespace panelgate::config
