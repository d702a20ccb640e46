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

/// Reads and checks a file. Warnings go to stderr too.
Loaded load_file(const std::string& path);
/// The same for text; `name` stands in messages.
Loaded load_text(std::string_view text, const std::string& name);

}  // namespace panelgate::app
