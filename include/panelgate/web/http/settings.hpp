#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/network.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::web {

enum class Role : std::uint8_t { none, viewer, operator_ };
/// As the configuration writes it.
inline std::string_view label(Role role) {
    constexpr std::array<std::string_view, 3> kWords{"none", "viewer", "operator"};
    return kWords[static_cast<std::size_t>(role)];
}

struct Token {
    std::string name;
    Role role = Role::viewer;
    std::string secret;  ///< read from its file at load
    friend bool operator==(const Token&, const Token&) = default;
};

/// How guesses at tokens are slowed down, by address.
struct LoginSettings {
    unsigned free = 5;              ///< wrong tokens that cost nothing
    Duration hold = 2s;             ///< for each wrong one beyond these, and each without a place
    unsigned a_second = 32;         ///< requests of an address that are looked at
    Duration longest_turn = 1s;     ///< nobody waits longer to be looked at
    Duration forgiven_after = 10s;  ///< each
    unsigned remembered = 20;       ///< at most, of an address
    std::size_t addresses = 256;    ///< at most
    friend bool operator==(const LoginSettings&, const LoginSettings&) = default;
};

/// What the answers to one address may take.
struct RationSettings {
    Duration request = 1ms;  ///< of an address's time, that each takes
    std::size_t bytes_a_second = 8 * 1024 * 1024;
    Duration burst = 250ms;       ///< of its time that need not have passed yet
    Duration longest_wait = 2s;   ///< of an answer
    std::size_t addresses = 256;  ///< from so many on those that have used up nothing are dropped
    friend bool operator==(const RationSettings&, const RationSettings&) = default;
};

struct Settings {
    std::string address = "127.0.0.1";
    std::uint16_t port = 8080;  ///< 0: any free one
    bool ipv6_only = false;     ///< of "::": another listener has this port for IPv4
    Role anonymous = Role::viewer;
    std::vector<Token> tokens;
    LoginSettings logins;
    RationSettings ration;
    std::vector<std::string> hosts;  ///< its names; empty: those of the machine
    std::vector<Network> allow;      ///< empty: all
    std::size_t max_connections = 256;
    std::size_t max_connections_per_address = 32;  ///< of these, but for those that stream events
    std::size_t max_streams_per_address = 48;      ///< that stream events
    std::size_t max_held = 64;             ///< and of an address that are told late of wrong tokens
    std::size_t probe_places = 16;         ///< beyond these: only what is free is answered there
    std::size_t max_body = 64 * 1024;      ///< bytes
    Duration first_request_timeout = 10s;  ///< of a connection that has not asked anything yet
    Duration idle_timeout = 60s;           ///< of a keep-alive connection
    Duration request_timeout = 10s;        ///< to receive one request, and to send one answer
    /// How long a client that has closed its sending side is waited for before it is asked whether
    /// it is still there, and how long between two such questions.
    Duration half_close_grace = 2s;

    std::string name() const { return endpoint_text(address, port); }
    /// What cannot change without closing the one listener and opening another.
    bool is_same_door(const Settings& other) const {
        return address == other.address && port == other.port && ipv6_only == other.ipv6_only;
    }
    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::web
