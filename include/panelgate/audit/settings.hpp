#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "panelgate/base/time.hpp"

namespace panelgate::audit {

/// What happens to writes while nothing can be recorded.
enum class OnFailure : std::uint8_t { keep_on, refuse_writes };

struct Settings {
    std::string file;
    std::size_t rotate = 50 * 1024 * 1024;  ///< bytes of a file; then the next one begins
    std::size_t keep = 20;                  ///< files besides the one that is written
    OnFailure on_failure = OnFailure::keep_on;
    Duration flush = 700ms;                ///< how long a record may wait to be on the disk
    std::size_t buffer = 2 * 1024 * 1024;  ///< bytes that wait while the disk takes nothing

    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::audit
