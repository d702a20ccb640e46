#pragma once

#include "commands.hpp"

namespace CLI {
class App;
}

namespace panelgate::commands {

/// The groups of `--help`.
inline constexpr const char* kBegin = "Begin";
inline constexpr const char* kRun = "Run";
inline constexpr const char* kAsk = "Ask a running gateway";
inline constexpr const char* kConfiguration = "Configuration";
inline constexpr const char* kTools = "Tools";

inline constexpr const char* kSecurity = "Security";

/// Adds the commands for who may do what and what was done: `audit` and `token`; as below.
void add_security_commands(CLI::App& cli, ExitCode& code);
/// Adds the commands that ask a running gateway over REST; they set `code`. Both outlive the
/// parsing.
void add_asking_commands(CLI::App& cli, ExitCode& code);

}  // namespace panelgate::commands
