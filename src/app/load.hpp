#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "exit_code.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::app {

/// A configuration, or the exit code to end with; then stderr has said why.
struct Loaded {
    std::optional<config::Config> config;
    ExitCode code = kFine;
};

/// Reads and checks a file. Its warnings are told by whoever uses it.
Loaded load_file(const std::string& path);
/// The same for text; `name` stands in messages.
Loaded load_text(std::string_view text, const std::string& name);
/// To stderr, a line each: of commands that keep no log.
void print_warnings(const config::Config& config);

}  // namespace panelgate::app
