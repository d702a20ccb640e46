#pragma once

#include <cstdint>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::scan {

/// What to look for, and how patiently. Lists that are empty allow everything.
struct Settings {
    std::vector<int> baud;
    std::vector<Parity> parity;
    std::vector<std::uint8_t> stations;  ///< 1 to 247; empty: 1 to 31
    bool remote = false;                 ///< RTU over TCP: the far end decides how characters look
    bool speak_anyway = false;           ///< although another master is heard

    Duration listen = 1s;  ///< before the first word
    Duration listen_each =
        500ms;  ///< in every other format, when the first gave bytes without sense
    Duration after_format = 20ms;  ///< drivers take their time to change
    /// From the end of a request to the first byte of its reply: while the format is unknown; for
    /// the last request before the format changes (a slow panel's reply would be lost); at the
    /// format that was found; for those that were silent then, and for stations that are known.
    Duration search_timeout = 60ms;
    Duration leave_timeout = 300ms;
    Duration first_timeout = 100ms;
    Duration second_timeout = 500ms;
    /// After a good reply before the next request; and while looking for a second one.
    Duration quiet = 5ms;
    Duration settle = 60ms;
    unsigned repeats = 6;         ///< of one read, to see whether its replies are alike
    unsigned most_repeats = 18;   ///< while damage leaves it open whether there are two
    unsigned damaged_tries = 12;  ///< of a request that only damaged replies answer
};

}  // namespace panelgate::scan
