#pragma once

#include "commands.hpp"

namespace CLI {
class App;
}

namespace panelgate::app {

/// The group of `--help`.
inline constexpr const char* kSecurity = "Security";

/// Adds the commands for who may do what and what was done: `audit` and `token`. They set `code`.
/// Both outlive the parsing.
void add_security_commands(CLI::App& cli, ExitCode& code);

}  // namespace panelgate::app
