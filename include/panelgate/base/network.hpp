#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace panelgate {

/// A network in CIDR form; a bare address is /32 or /128.
struct Network {
    std::string address;
    unsigned prefix = 0;
    friend bool operator==(const Network&, const Network&) = default;
};

/// An IPv6 address; IPv4 is stored as ::ffff:10.0.0.1 (RFC 4291, 2.5.5.2).
using AddressBytes = std::array<std::uint8_t, 16>;
/// True if the first `bits` bits are equal; `bits` is at most 128.
bool same_prefix(const AddressBytes& left, const AddressBytes& right, unsigned bits);

/// Formats "127.0.0.1:502"; an IPv6 address is put in brackets: "[::1]:502".
inline std::string endpoint_text(const std::string& address, std::uint16_t port) {
    const bool six = address.find(':') != std::string::npos;
    return (six ? '[' + address + ']' : address) + ':' + std::to_string(port);
}

/// Returns a client's name for the log without its port, which differs for each connection:
/// "modbus_tcp [::1]:50000" -> "modbus_tcp [::1]". A bare address ("http ::1") and a token ("http
/// ::1 token bob") identify the client and are kept.
inline std::string without_port(std::string_view client) {
    constexpr auto kNone = std::string_view::npos;
    const auto colon = client.rfind(':');
    if (colon == kNone || client.find(" token ") != kNone) return std::string(client);
    const std::string_view host = client.substr(client.rfind(' ') + 1, kNone);
    const bool is_number = client.find_first_not_of("0123456789", colon + 1) == kNone;
    const bool has_brackets = colon > 0 && client[colon - 1] == ']';
    const bool is_port = has_brackets || host.find(':') == host.rfind(':');
    return std::string(is_number && is_port ? client.substr(0, colon) : client);
}

}  // namespace panelgate
