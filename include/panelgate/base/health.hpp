#pragma once

#include <cstdint>
#include <string_view>

namespace panelgate {

/// How a station does.
enum class Health : std::uint8_t {
    unknown,  ///< not asked yet
    online,
    suspect,  ///< its last transaction failed, and it is not offline for that
    heard,    ///< answers its line's master, who is somebody else
    offline,  ///< it stays silent: asked by probes only (P4)
};
std::string_view label(Health health);

}  // namespace panelgate
