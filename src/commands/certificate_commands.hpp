#pragma once

#include "commands.hpp"

namespace CLI {
class App;
}

namespace panelgate::commands {

/// Adds `cert`, which makes the certificates of a small plant; it sets `code`. Both outlive the
/// parsing.
void add_certificate_commands(CLI::App& cli, ExitCode& code);

}  // namespace panelgate::commands
