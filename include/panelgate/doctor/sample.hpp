#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "panelgate/arbiter/counters.hpp"
#include "panelgate/base/echo_state.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/line/counters.hpp"

namespace panelgate::doctor {

/// What the configuration says, as far as advice depends on it.
struct LineFacts {
    SerialFormat serial;
    EchoMode echo = EchoMode::automatic;
    /// RTU over TCP: the wire is behind a server, which nobody here can see or set.
    bool over_tcp = false;
    Duration deadline = 2s;  ///< of a request: no reply later than this is ever waited for
    Duration response_timeout = 500ms;  ///< of stations without an entry below
    std::map<std::uint8_t, Duration> response_timeouts;
    std::map<std::uint8_t, std::string> names;  ///< of the stations that are listed
    std::set<std::uint8_t> crc_high_first;      ///< stations that are set so
};

/// The counts of one line: at an instant, or (as a difference of two) of a window.
struct Sample {
    /// Entry 0: all stations that the configuration does not list.
    std::map<std::uint8_t, arbiter::Symptoms> stations;
    std::optional<line::UartErrors> uart;
    std::uint64_t broadcasts = 0;  ///< sent: a panel should not answer these

    /// Of all stations together; mute_in_a_row and worst_lateness are the largest of them.
    arbiter::Symptoms total() const;
    std::uint64_t attempts() const;
};

/// What was counted between two instants of one line. What does not only grow (mute_in_a_row,
/// worst_lateness) is that of `later`.
Sample difference(const Sample& later, const Sample& earlier);

}  // namespace panelgate::doctor
