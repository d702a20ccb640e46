#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::explain {

/// Exit codes (docs/reference/cli.md), after sysexits(3).
enum ExitCode : int {
    kFine = 0,
    kCut = 1,       ///< a second signal came: outstanding requests were not answered
    kNotReady = 1,  ///< health: /readyz is not 200
    kNotSet = 1,    ///< config get: the key is not set
    kNo = 1,        ///< audit: the chain is not whole; no such record
    kDenied = 1,    ///< check --explain: the request is denied
    kUsage = 64,
    kNoInput = 66,
    kUnavailable = 69,
    kInternal = 70,
    kUnknown = 75,  ///< reload: told to, and cannot be asked what came of it
    kBadConfig = 78,
};

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
    std::string text = {};   ///< of a file, as it was read
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

}  // namespace panelgate::explain
