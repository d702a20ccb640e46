#pragma once

#include <cstddef>
#include <string>

#include "panelgate/config/config.hpp"

namespace panelgate::app {

// What is kept back of the descriptors that this process may have, so that clients cannot take
// those away that devices, probes and the log need.

/// The loop, the log, listeners, signals, files that are read, and connections that are told that
/// there is no room, or that ask only whether all is well.
inline constexpr std::size_t kOwnDescriptors = 64;
/// A device and its watch, or a connection and the one that follows it; the two ends of a simulated
/// wire; what the look-up of a name opens.
inline constexpr std::size_t kDescriptorsPerLine = 8;

/// Lowers `max_connections` of all listeners to what `limit` descriptors allow. What was lowered,
/// in words; empty when nothing had to be.
std::string fit_connections(config::Config& config, std::size_t limit);

}  // namespace panelgate::app
