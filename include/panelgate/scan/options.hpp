#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/scan/settings.hpp"

namespace panelgate::scan {

/// Parse lists of the command line into settings: "9600,38400"; "none,even"; "1-31", "5,17,20-31".
/// Return nullopt, or what is wrong and what is expected; the settings are then unchanged.
std::optional<std::string> parse_baud(std::string_view text, Settings& settings);
std::optional<std::string> parse_parity(std::string_view text, Settings& settings);
std::optional<std::string> parse_stations(std::string_view text, Settings& settings);

/// Parses "5,17,20-31" into ascending unique addresses; nullopt if malformed.
std::optional<std::vector<std::uint8_t>> station_list(std::string_view text);
/// The shortest list that station_list() reads back: "5,17,20-31"; "" for none.
std::string station_ranges(const std::set<std::uint8_t>& stations);
/// What is expected, to follow "is not".
inline constexpr const char* kStationListForm =
    "a list of addresses from 1 to 247 such as 1-31 or 5,17,20-31";

}  // namespace panelgate::scan
