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

/// What a master receives when a panel has not answered (06, 0A, 0B).
enum class OnFailure : std::uint8_t {
    exception,
    silence  ///< like an absent slave: the one failure every master handles
};

/// Settings of a serial port with an external master.
struct Settings {
    std::string name;
    line::Settings device;
    /// What it may access: lines, units, framing, read_only, broadcast (silent or deny). The
    /// gateway has no unit of its own here: 248..255 are reserved (SL 2.2).
    tcp_server::Settings access;
    OnFailure on_failure = OnFailure::silence;
    EchoMode echo = EchoMode::automatic;  ///< whether transmissions to the master are echoed
    /// The master's timeout, from the end of its request to the start of the reply; a later reply
    /// is not sent. Unset: only its next transmission shows that it has given up.
    std::optional<Duration> response_timeout;
    /// Longest gap within a frame, in addition to the time of a chunk: as on lines.
    Duration hole = 60ms;
    /// The same after fewer bytes than the shortest frame has: a transceiver that switches off
    /// produces them. Longer than an adapter's latency timer.
    Duration glitch = 20ms;
    std::size_t open_broadcasts = 8;  ///< outstanding on the lines; more are dropped
    /// True if `other` differs only in what can change without reopening the port: what the master
    /// may access, and how failures and broadcasts are answered.
    bool is_same_port(const Settings& other) const {
        return name == other.name && device == other.device && echo == other.echo &&
               access.framing == other.access.framing && hole == other.hole &&
               glitch == other.glitch && response_timeout == other.response_timeout;
    }
    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::serial_server
