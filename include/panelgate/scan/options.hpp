#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::scan {

/// What to look for, with which timeouts. Empty lists allow everything.
struct Settings {
    std::vector<int> baud;
    std::vector<Parity> parity;
    std::vector<std::uint8_t> stations;  ///< 1 to 247; empty: 1 to 31
    bool remote = false;                 ///< RTU over TCP: the far end sets the serial format
    bool speak_anyway = false;           ///< send even if another master is heard

    Duration listen = 1s;          ///< before the first request
    Duration listen_each = 500ms;  ///< in every other format, if the first gave unreadable bytes
    Duration after_format = 20ms;  ///< drivers need time to change
    /// Timeouts from the end of a request to the first byte of its reply: while the format is
    /// unknown; for the last request before a format change (a slow panel's reply would be lost);
    /// in the format found; for stations that were silent then, and for known stations.
    Duration search_timeout = 60ms;
    Duration leave_timeout = 300ms;
    Duration first_timeout = 100ms;
    Duration second_timeout = 500ms;
    /// Delay after a good reply before the next request; and when waiting for a second reply.
    Duration quiet = 5ms;
    Duration settle = 60ms;
    unsigned repeats = 6;         ///< of one read, to see whether its replies are alike
    unsigned most_repeats = 18;   ///< while damage leaves open whether there are two stations
    unsigned damaged_tries = 12;  ///< of a request that gets only damaged replies
    /// Asks each silent address once: not again with patience, nor in the other order of the CRC.
    bool quick = false;
};

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
