#pragma once

#include <string>

#include "commands.hpp"

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

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
/// Adds `cert`, which makes the certificates of a small plant; as above.
void add_certificate_commands(CLI::App& cli, ExitCode& code);

/// Makes `--help` of all commands 80 characters wide, and puts an example of use before each
/// command's notes. Called once, when all commands are there.
void shape_help(CLI::App& cli);

/// Makes every option of all commands refuse an empty value: it was meant to say something, and
/// comes from a script's variable that is not set.
void refuse_empty_values(CLI::App& app);

/// Rewords a CLI11 error: "--format must be text or json, not 'xml'". Without the command's name
/// and without a full stop.
std::string usage_fault(const CLI::ParseError& error);

}  // namespace panelgate::commands
