#pragma once

#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace panelgate::commands {

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
