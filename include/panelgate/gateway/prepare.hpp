#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/web/http/message.hpp"

namespace panelgate::gateway {

/// A listener on "[::]:502" serves IPv4 as well, unless another one has that port on an IPv4
/// address: then it serves IPv6 only.
void separate_families(config::Config& config);

// Descriptors reserved for devices, probes and the log, so that clients cannot use up all
// descriptors.

/// The loop, the log, listeners, signals, files being read, connections that are refused for lack
/// of room, and health probes.
inline constexpr std::size_t kOwnDescriptors = 64;
/// Per line: a device and its watch, or a connection and its successor; the two ends of a simulated
/// wire; what a name look-up opens.
inline constexpr std::size_t kDescriptorsPerLine = 8;

/// Lowers `max_connections` of all listeners to what `limit` descriptors allow. Returns the new
/// limits in words; empty if nothing was lowered.
std::string fit_connections(config::Config& config, std::size_t limit);

/// Seconds since 1970.
std::int64_t seconds_since_1970();

/// A warning about a valid configuration, for the log.
struct StartMessage {
    std::string event;
    std::string text;
};
/// Adapts a configuration to this machine and this process (address families, descriptors). Returns
/// its warnings, planned overloads and lowered limits.
std::vector<StartMessage> prepare(config::Config& config);
/// The configuration as shown by REST.
std::string shown_text(const config::Config& config);

}  // namespace panelgate::gateway
