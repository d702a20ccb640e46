#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/network.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/tls/settings.hpp"

namespace panelgate::web {

struct Token {
    std::string name;
    Standing standing = Role::viewer;
    std::string hash;  ///< hash_of() the token, whose file holds it or its hash
    std::string file{};
    std::size_t characters = 0;         ///< of the token; 0: its file holds the hash
    std::optional<WallTime> expires{};  ///< from then on it is not known any more

    bool has_expired(WallTime now) const { return expires && *expires <= now; }
    friend bool operator==(const Token&, const Token&) = default;
};

/// What a file may hold in place of a token, and what is kept of it: "sha256:" and 64 hex digits.
std::string hash_of(std::string_view token);
bool is_token_hash(std::string_view text);
/// Parses a token's last day ("2027-12-31": until its end) or an instant ("2027-12-31T18:00:00Z"),
/// in UTC.
std::optional<WallTime> parse_expiry(std::string_view text);
std::string expiry_text(WallTime expires);

/// How many wrong tokens of an address are judged.
struct WrongTokenSettings {
    unsigned most = 10;           ///< beyond them the address gets 429 until `within` is over
    Duration within = 1min;       ///< from the first wrong token on
    std::size_t addresses = 256;  ///< counted; beyond it, the oldest is dropped
    friend bool operator==(const WrongTokenSettings&, const WrongTokenSettings&) = default;
};

struct Settings {
    std::string address = "127.0.0.1";
    std::uint16_t port = 8080;          ///< 0: any free port
    bool ipv6_only = false;             ///< with "::": another listener has this port on IPv4
    Standing anonymous = Role::viewer;  ///< of clients that show nothing
    std::vector<Token> tokens;
    WrongTokenSettings wrong_tokens;
    std::vector<std::string> hosts;  ///< its host names; empty: the machine's
    std::vector<Network> allow;      ///< empty: all
    std::vector<std::string> cors;   ///< origins of other sites whose pages may read, lower case
    std::size_t max_connections = 256;
    std::size_t max_connections_per_address = 32;  ///< excluding event streams
    std::size_t max_streams_per_address = 48;      ///< event streams
    std::size_t probe_places = 16;                 ///< additional places, for probes only
    std::size_t max_body = 64 * 1024;              ///< bytes of a request
    std::size_t max_sending = 64 * 1024 * 1024;    ///< bytes of all long bodies being sent
    Duration first_request_timeout = 10s;          ///< of a new connection
    Duration idle_timeout = 60s;                   ///< of a keep-alive connection
    Duration request_timeout = 10s;  ///< to receive one request, and to send one answer
    /// How long after a half-close the client is first probed, and how long between probes.
    Duration half_close_grace = 2s;
    std::optional<tls::Settings> tls{};  ///< HTTPS; none: plain

    std::string scheme() const { return tls ? "https://" : "http://"; }
    std::string name() const { return endpoint_text(address, port); }
    /// True if `other` differs only in what can change without reopening the listener.
    bool is_same_listener(const Settings& other) const {
        return address == other.address && port == other.port && ipv6_only == other.ipv6_only &&
               tls.has_value() == other.tls.has_value();
    }
    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::web
