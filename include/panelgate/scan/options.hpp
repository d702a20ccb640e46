#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/scan/settings.hpp"

namespace panelgate::scan {

/// The lists of the command line into settings. Nothing, or what is wrong and would be right; then
/// the settings are as before. "9600,38400"; "none,even"; "1-31", "5,17,20-31".
std::optional<std::string> parse_baud(std::string_view text, Settings& settings);
std::optional<std::string> parse_parity(std::string_view text, Settings& settings);
std::optional<std::string> parse_stations(std::string_view text, Settings& settings);

/// "5,17,20-31" as addresses, upwards, each once; nothing when it is none.
std::optional<std::vector<std::uint8_t>> station_list(std::string_view text);
/// What is missing then, behind "is not".
inline constexpr const char* kStationListForm =
    "a list of addresses from 1 to 247 such as 1-31 or 5,17,20-31";

}  // namespace panelgate::scan
