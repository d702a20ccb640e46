#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "panelgate/scan/settings.hpp"

namespace panelgate::scan {

/// The lists of the command line into settings. Nothing, or what is wrong and would be right; then
/// the settings are as before. "9600,38400"; "none,even"; "1-31", "5,17,20-31".
std::optional<std::string> parse_baud(std::string_view text, Settings& settings);
std::optional<std::string> parse_parity(std::string_view text, Settings& settings);
std::optional<std::string> parse_stations(std::string_view text, Settings& settings);

}  // namespace panelgate::scan
