#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace panelgate {

/// Who goes first on a line (P9).
enum class PriorityClass : std::uint8_t { write, read, poll, probe };
inline constexpr std::size_t kPriorityClasses = 4;

/// The word of the label `class` of panelgate_queue_wait_seconds, and of the reasons in a trace.
std::string_view label(PriorityClass priority);

}  // namespace panelgate
