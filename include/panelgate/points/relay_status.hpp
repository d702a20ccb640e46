#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "panelgate/base/time.hpp"

namespace panelgate::points {

struct RelayStatus {
    std::string name;
    /// "waiting" before the first transfer, "ok", "source failing: …", "target failing: …"
    std::string state = "waiting";
    std::uint64_t reads = 0;
    std::uint64_t writes = 0;
    std::uint64_t read_failures = 0;
    std::uint64_t write_failures = 0;
    std::optional<TimePoint> last_write;
};

}  // namespace panelgate::points
