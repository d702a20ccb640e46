#pragma once

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

namespace panelgate::tcp_server {

/// What happens to unit 0 with a write.
enum class BroadcastMode : std::uint8_t { reply, silent, deny };

/// Which repetitions (the same transaction id, unit and bytes, while the first is unanswered) get
/// the one answer, and no turn on the bus of their own.
enum class Retransmissions : std::uint8_t { join_writes, join, pass };

struct UnitTarget {
    std::string line;
    std::uint8_t station = 0;
    friend bool operator==(const UnitTarget&, const UnitTarget&) = default;
};

/// One listener for Modbus over TCP.
struct Settings {
    std::string address = "127.0.0.1";
    std::uint16_t port = 502;                  ///< 0: any free one
    bool ipv6_only = false;                    ///< of "::": another listener has this port for IPv4
    std::vector<std::string> lines;            ///< names; never empty after loading
    std::map<std::uint8_t, UnitTarget> units;  ///< aliases, looked up before `lines`
    modbus::Framing framing = modbus::Framing::tcp;
    modbus::HexDigits ascii_digits = modbus::HexDigits::upper_only;
    BroadcastMode broadcast = BroadcastMode::reply;  ///< with framing tcp; else nobody is answered
    Retransmissions retransmissions = Retransmissions::join_writes;
    /// The same port for datagrams, too (framing tcp only); there every repetition is joined,
    /// unless `retransmissions` is pass.
    bool udp = false;
    std::size_t udp_peers_per_address = 16;  ///< ports that may wait for answers
    Duration udp_idle = 1min;                ///< then a sender of datagrams is forgotten
    /// Datagrams without room that wait to be answered 06 (own_answers); more are dropped.
    std::size_t udp_busy_answers = 256;
    std::optional<std::uint8_t> diagnostics_unit = 255;
    bool read_only = false;
    std::vector<Network> allow;  ///< empty: all
    std::size_t max_connections = 1024;
    /// Of one address (IPv6: one network of 64 bits): then its longest idle one gives way.
    std::size_t max_connections_per_address = 64;
    /// Requests of one connection on the buses, or answered and not yet taken by the client.
    std::size_t in_flight = 16;
    std::size_t waiting = 64;  ///< requests that wait behind them; then nobody reads
    /// What the gateway answers by itself, without a line, for all connections together.
    std::size_t own_answers = 16;  ///< in a period, then they wait for the next one
    Duration own_answers_period = 1ms;
    Duration partial_adu_timeout = 5s;  ///< a half-sent ADU closes its connection
    int bad_protocol_ids = 3;           ///< in a row close the connection
    // Of RTU and ASCII.
    Duration rtu_silence = 50ms;       ///< ends a request whose function tells no length
    Duration ascii_pause = 1s;         ///< between two characters of a frame (SL 2.5.2.1)
    std::size_t garbage_limit = 1024;  ///< bytes in a row that are no request close the connection
    Duration output_timeout = 5min;    ///< a client that takes nothing for so long is closed

    // For the identification of the gateway (2B/0E); may be empty.
    std::string url;   ///< of its pages
    std::string host;  ///< name of the machine

    std::string name() const { return endpoint_text(address, port); }
    /// What cannot change without closing the one listener and opening another.
    bool is_same_door(const Settings& other) const {
        return address == other.address && port == other.port && ipv6_only == other.ipv6_only &&
               framing == other.framing && ascii_digits == other.ascii_digits && udp == other.udp;
    }
    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::tcp_server
