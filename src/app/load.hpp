#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "commands.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::app {

/// The shipped profiles, and those of --profiles DIR if it is not empty; nothing, with a message on
/// stderr, if they have faults.
std::optional<profile::Catalogue> load_catalogue(const std::string& dir);

/// A configuration, or the exit code and what is wrong.
struct Loaded {
    std::optional<config::Config> config;
    ExitCode code = kFine;
    /// What is wrong if there is no configuration; a file that cannot be read has no position (line
    /// 0).
    std::vector<yaml::Problem> problems;
    std::string error_text;  ///< the same as text for stderr; empty for an unreadable file
};

/// The path to read; `-` is standard input.
std::string path_of(const std::string& typed);
/// Parses and checks a text without printing anything.
Loaded read_text(std::string_view text, const std::string& name);
/// Reads and checks a file without printing anything.
Loaded read_file(const std::string& path);
/// Reads and checks a file (`-`: standard input) and prints its faults; the caller prints the
/// warnings. `option`: the option that named the file, for the message.
Loaded load_file(const std::string& typed, const std::string& option = "-c");
/// The same for a text; `name` is used in messages.
Loaded load_text(std::string_view text, const std::string& name);
/// The configuration in a file; nothing, without a message, if it cannot be read or has faults.
std::optional<config::Config> read_quietly(const std::string& typed);
/// Prints the warnings to stderr, one line each, for commands without a log.
void print_warnings(const config::Config& config);

/// A listener on "[::]:502" serves IPv4 as well, unless another one has that port on an IPv4
/// address: then it serves IPv6 only.
void separate_families(config::Config& config);

// Descriptors that are reserved, so that clients cannot take those that devices, probes and the log
// need.

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
web::SharedText shown_text(const config::Config& config);

}  // namespace panelgate::app
