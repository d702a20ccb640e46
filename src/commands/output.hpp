#pragma once

#include <string>

#include "commands.hpp"

namespace panelgate::commands {

/// Prints what has been done and must not be done again because nobody could read of it: on stderr
/// if stdout takes nothing. stdout then goes nowhere.
void print_done(const std::string& text);

/// Checks whether the file can be written, without creating it; says on stderr why not.
ExitCode may_write(const OutputFile& output);
/// Writes the file; errno says why not.
bool write(const OutputFile& output, const std::string& text);
/// Says that on stderr, by errno.
ExitCode cannot_write(const OutputFile& output);

/// For commands that print for as long as they run: ends the process because stdout takes nothing,
/// with kFine if its reader is gone, else with kInternal and the reason on stderr.
[[noreturn]] void end_without_output();

}  // namespace panelgate::commands
