#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate::doctor {

/// The codes of causes, in the order of Cause.
inline constexpr std::array<std::string_view, 25> kCauses{
    "echo",
    "telnet",
    "no-answer-at-all",
    "wrong-baud",
    "wrong-parity",
    "other-master",
    "collision",
    "overrun",
    "noise",
    "tcp-framing",
    "trailing-bytes",
    "wrong-crc-order",
    "ascii-lower-case",
    "ascii-delimiters",
    "wrong-exception",
    "wrong-reply",
    "answers-broadcasts",
    "damaged-replies",
    "duplicate-address",
    "timeout-too-short",
    "gap-too-short",
    "unasked-frames",
    "station-silent",
    "repeats-requests",
    "misses-requests",
};

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
