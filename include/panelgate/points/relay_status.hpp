#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate::points {

enum class RelayState : std::uint8_t { waiting, ok, source_failing, target_failing };
std::string_view label(RelayState state);

struct RelayStatus {
    std::string name;
    RelayState state = RelayState::waiting;  ///< before the first transfer
    std::string why;                         ///< it fails: an outcome, or "exception 2"
    std::uint64_t reads = 0;
    std::uint64_t writes = 0;
    std::uint64_t repairs = 0;  ///< of these: after somebody else had written there
    std::uint64_t read_failures = 0;
    std::uint64_t write_failures = 0;
    std::optional<TimePoint> last_write;
};
/// "ok", "source failing: timeout"
std::string text_of(const RelayStatus& relay);

}  // namespace panelgate::points
