#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "commands.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::app {

/// The shipped profiles, and those of --profiles DIR when it is not empty; nothing, and told, when
/// something is wrong there.
std::optional<profile::Catalogue> load_catalogue(const std::string& dir);

/// A configuration, or the exit code to end with; then stderr has said why.
struct Loaded {
    std::optional<config::Config> config;
    ExitCode code = kFine;
    /// What is wrong, when there is no configuration; of a file that cannot be read without a place
    /// (line 0).
    std::vector<yaml::Problem> problems;
    std::string told;  ///< the same for stderr; not of a file that cannot be read
};

/// What is read: `-` is standard input.
std::string path_of(const std::string& typed);
/// Checks a text, and tells nobody but whoever calls.
Loaded read_text(std::string_view text, const std::string& name);
/// Reads and checks a file, and tells nobody but whoever calls.
Loaded read_file(const std::string& path);
/// Reads and checks a file, `-` for standard input. Its warnings are told by whoever uses it.
/// `option`: who named it, and may name another one.
Loaded load_file(const std::string& typed, const std::string& option = "-c");
/// The same for text; `name` stands in messages.
Loaded load_text(std::string_view text, const std::string& name);
/// What a file holds; nothing, and nothing told, when it cannot be read or has faults.
std::optional<config::Config> read_quietly(const std::string& typed);
/// To stderr, a line each: of commands that keep no log.
void print_warnings(const config::Config& config);

}  // namespace panelgate::app
