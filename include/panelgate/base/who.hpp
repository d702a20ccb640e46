#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "panelgate/base/role.hpp"

namespace panelgate {

/// Where a request comes in.
enum class Face : std::uint8_t {
    modbus_tcp,     ///< also its RTU and ASCII framings
    udp,            ///< datagrams of a Modbus/TCP listener
    serial_master,  ///< a master on a serial line of its own
    http,
    mqtt,
    gateway,  ///< the gateway itself: polls, relays, discoveries, probes
};
/// Returns "modbus_tcp", "udp", "serial_master", "http", "mqtt", "gateway": stable identifiers.
std::string_view label(Face face);

/// Who asks: set once where a request comes in, and carried along with it. Immutable once made.
struct Who {
    Face face = Face::modbus_tcp;
    /// As in logs and traces: "modbus_tcp 10.0.0.7:51234", "http ::1 token ops", "poll of press".
    std::string name{};
    std::string address{};  ///< without port, IPv4 as such; empty: it has none
    /// The listener's "ADDRESS:PORT", the serial master's name or the broker's address.
    std::string listener{};
    std::string token{};  ///< the token's name; empty: none
    /// The token's or the certificate's, or what the door gives to somebody without either.
    Standing standing{};
    std::string certificate{};       ///< the subject of the client's certificate; empty: none
    std::string certificate_role{};  ///< the role that it carries, in its own words
    std::string user{};              ///< at the broker, for MQTT
    /// The same for all clients that must share one client's turns (P9), from host_number(). Not an
    /// identity: 0 is a host of its own.
    std::uint64_t host = 0;
    friend bool operator==(const Who&, const Who&) = default;
};
/// Shared by all requests of a client; null only where nobody has said who asks.
using WhoRef = std::shared_ptr<const Who>;

/// Completes what follows from the rest: an IPv4 address seen by a listener on [::] becomes IPv4,
/// and the host is set from the address where there is one.
WhoRef make_who(Who who);
/// The gateway's own tasks, by the name that the trace shows.
WhoRef own_task(std::string name);

/// A number for fair turns between hosts (HostKey), or other names of one client; never 0.
std::uint64_t host_number(std::string_view address);

/// Returns its name; "a client without a name" for null.
std::string text_of(const WhoRef& who);

}  // namespace panelgate
