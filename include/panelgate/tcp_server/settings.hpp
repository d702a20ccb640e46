#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/network.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/tls/settings.hpp"

namespace panelgate::tcp_server {

/// How a write to unit 0 is handled.
enum class BroadcastMode : std::uint8_t { reply, silent, deny };

/// Which retransmissions (same transaction id, unit and bytes, while the first is unanswered) share
/// its one answer instead of using the bus again.
enum class Retransmissions : std::uint8_t { join_writes, join, pass };

/// Which exceptions a client gets; silence in place of the others, so that the client's own timeout
/// decides (Citect takes a whole device offline for 0B, se.com FA209453).
enum class Exceptions : std::uint8_t {
    all,
    own,   ///< those of panels; none of the gateway's own
    none,  ///< nor those of panels
};

struct UnitTarget {
    std::string line;
    std::uint8_t station = 0;
    friend bool operator==(const UnitTarget&, const UnitTarget&) = default;
};

/// Settings of one Modbus over TCP listener.
struct Settings {
    std::string address = "127.0.0.1";
    std::uint16_t port = 502;        ///< 0: any free port
    bool ipv6_only = false;          ///< with "::": another listener has this port on IPv4
    std::vector<std::string> lines;  ///< line names; never empty after loading
    /// True if the listener serves all these lines.
    bool serves_all(const std::vector<std::string>& names) const {
        return std::ranges::all_of(names, [this](const std::string& name) {
            return lines.empty() || std::ranges::count(lines, name) > 0;
        });
    }
    std::map<std::uint8_t, UnitTarget> units;  ///< aliases, looked up before `lines`
    modbus::Framing framing = modbus::Framing::tcp;
    modbus::HexDigits ascii_digits = modbus::HexDigits::upper_only;
    BroadcastMode broadcast = BroadcastMode::reply;  ///< with framing tcp; otherwise always silent
    Retransmissions retransmissions = Retransmissions::join_writes;
    Exceptions exceptions = Exceptions::all;
    /// Also serve UDP on the same port (framing tcp only); there every retransmission is joined
    /// unless `retransmissions` is pass.
    bool udp = false;
    /// Ports with outstanding requests; at most half of max_connections, whatever this says.
    std::size_t udp_peers_per_address = 16;
    /// The gateway's own registers. None by default: clients without a unit id ask 255 or 0.
    std::optional<std::uint8_t> diagnostics_unit;
    bool read_only = false;
    std::vector<Network> allow;  ///< empty: all
    std::size_t max_connections = 1024;
    /// Beyond it an address's longest-idle connection is evicted. IPv6 addresses are counted one by
    /// one: all clients of a plant may share a /64 network.
    std::size_t max_connections_per_address = 64;
    /// Requests of one connection on the buses, or with replies the client has not taken yet.
    std::size_t in_flight = 16;
    std::size_t waiting = 64;  ///< requests queued behind them; beyond it reading stops
    /// Replies the gateway generates itself, without a line, for all connections together.
    std::size_t own_answers = 16;  ///< per period; more wait for the next
    Duration own_answers_period = 1ms;
    Duration partial_adu_timeout = 5s;  ///< an ADU not completed in time closes its connection
    /// Without a further byte for this long a connection with a half-sent ADU counts as idle and
    /// may give way. TCP has sent a lost segment three times by then (after 0.2, 0.6 and 1.4 s).
    Duration half_sent_pause = 2s;
    int bad_protocol_ids = 3;  ///< consecutive ones that close the connection
    // RTU and ASCII only.
    Duration rtu_silence = 50ms;       ///< ends a request whose function implies no length
    Duration ascii_pause = 1s;         ///< between two characters of a frame (SL 2.5.2.1)
    std::size_t garbage_limit = 1024;  ///< bytes without a request that close the connection
    Duration output_timeout = 5min;    ///< a client that reads nothing for this long is closed

    // For the device identification (2B/0E); may be empty.
    std::string url;   ///< of the web interface
    std::string host;  ///< host name

    std::optional<tls::Settings> tls{};  ///< Modbus/TCP Security; none: plain

    std::string name() const { return endpoint_text(address, port); }
    /// True if `other` differs only in what can change without reopening the listener.
    bool is_same_listener(const Settings& other) const {
        return address == other.address && port == other.port && ipv6_only == other.ipv6_only &&
               framing == other.framing && ascii_digits == other.ascii_digits && udp == other.udp &&
               tls.has_value() == other.tls.has_value();
    }
    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::tcp_server
