#pragma once

#include <string>

namespace panelgate::commands {

/// Prints what has been done and must not be done again because nobody could read of it: on stderr
/// if stdout takes nothing. stdout then goes nowhere.
void print_done(const std::string& text);

/// For commands that print for as long as they run: ends the process because stdout takes nothing,
/// with kFine if its reader is gone, else with kInternal and the reason on stderr.
[[noreturn]] void end_without_output();

}  // namespace panelgate::commands
