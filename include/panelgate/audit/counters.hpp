#pragma once

#include <cstdint>

namespace panelgate::audit {

struct Counters {
    std::uint64_t records = 0;   ///< written and synchronized with the disk
    std::uint64_t lost = 0;      ///< for which there was no room while the disk took nothing
    std::uint64_t failures = 0;  ///< how often writing began to fail
    std::uint64_t rotations = 0;
    std::uint64_t waiting_bytes = 0;
    bool failing = false;
    std::uint64_t syslog_lost = 0;  ///< records that syslog did not take
};

}  // namespace panelgate::audit
