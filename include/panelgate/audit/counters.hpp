#pragma once

#include <cstdint>

namespace panelgate::audit {

struct Counters {
    std::uint64_t records = 0;   ///< written and synchronized with the disk
    std::uint64_t lost = 0;      ///< for which there was no room while the disk took nothing
    std::uint64_t failures = 0;  ///< how often writing began to fail
    std::uint64_t rotations = 0;
    bool failing = false;
};

}  // namespace panelgate::audit
