#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/endpoint_text.hpp"
#include "panelgate/base/network.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::tcp_server {

/// What happens to unit 0 with a write.
enum class BroadcastMode : std::uint8_t { reply, silent, deny };

struct UnitTarget {
    std::string line;
    std::uint8_t station = 0;
};

/// One Modbus/TCP listener.
struct Settings {
    std::string address = "127.0.0.1";
    std::uint16_t port = 502;                  ///< 0: any free one
    bool ipv6_only = false;                    ///< of "::": another listener has this port for IPv4
    std::vector<std::string> lines;            ///< names; never empty after loading
    std::map<std::uint8_t, UnitTarget> units;  ///< aliases, looked up before `lines`
    BroadcastMode broadcast = BroadcastMode::reply;
    std::optional<std::uint8_t> diagnostics_unit = 255;
    bool read_only = false;
    std::vector<Network> allow;  ///< empty: all
    std::size_t max_connections = 1024;
    /// Requests of one connection on the buses, or answered and not yet taken by the client.
    std::size_t in_flight = 16;
    std::size_t waiting = 64;  ///< requests that wait behind them; then nobody reads
    /// What the gateway answers by itself, without a line, for all connections together.
    std::size_t own_answers = 16;  ///< in a period, then they wait for the next one
    Duration own_answers_period = 1ms;
    Duration partial_adu_timeout = 5s;  ///< a half-sent ADU closes its connection
    int bad_protocol_ids = 3;           ///< in a row close the connection
    Duration output_timeout = 5min;     ///< a client that takes nothing for so long is closed

    std::string name() const { return endpoint_text(address, port); }
};

}  // namespace panelgate::tcp_server
