#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/tcp_server/settings.hpp"

namespace panelgate::serial_server {

/// What a master is told when the gateway has no answer of a panel (06, 0A, 0B).
enum class OnFailure : std::uint8_t {
    exception,
    silence  ///< as of a slave that is not there: the one failure that every master knows
};

/// A master on a serial port of its own, as a client.
struct Settings {
    std::string name;
    line::Settings device;
    /// Whom it may ask, and what: lines, units, framing, read_only, broadcast (silent or deny). The
    /// gateway has no unit of its own here: 248..255 are reserved (SL 2.2).
    tcp_server::Settings access;
    OnFailure on_failure = OnFailure::silence;
    EchoMode echo = EchoMode::automatic;  ///< of what is sent to the master
    /// The master's own, from the end of its request to the start of the reply: what would begin
    /// later is not sent. Nothing: only its next words tell that it has given up.
    std::optional<Duration> response_timeout;
    /// The longest pause within a frame, besides the time of a chunk: as on lines.
    Duration hole = 60ms;
    /// Behind fewer bytes than the shortest frame has: a transceiver that was switched off makes
    /// them. Longer than an adapter's latency timer.
    Duration glitch = 20ms;
    std::size_t open_broadcasts = 8;  ///< on the lines; more are dropped
    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::serial_server
