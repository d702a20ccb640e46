#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/web/http/message.hpp"

namespace panelgate::app {

/// A listener on "[::]:502" serves IPv4 as well, unless another one has that port on an address of
/// IPv4: then each has its own kind.
void separate_families(config::Config& config);

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

/// Something legal that is worth a word in the log.
struct Notice {
    std::string event;
    std::string text;
};
/// Fits what was read to this machine and this process (address families, descriptors), and says
/// what is worth a word: its own warnings, lines that are planned too full, what had to be lowered.
std::vector<Notice> prepare(config::Config& config);
/// As REST shows it.
web::SharedText shown_text(const config::Config& config);

}  // namespace panelgate::app
