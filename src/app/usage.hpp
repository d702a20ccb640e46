#pragma once

#include <CLI/Error.hpp>
#include <string>

namespace panelgate::app {

/// What is wrong with a command line that CLI11 refuses, in our words: "--format must be text or
/// json, not 'xml'". Without the command's name and without an end.
std::string usage_fault(const CLI::ParseError& error);

}  // namespace panelgate::app
