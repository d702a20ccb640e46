#pragma once

#include <array>
#include <compare>
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

/// What counts as one address wherever places, turns or tries are counted by address: an IPv4
/// address, or the 64 first bits of an IPv6 address, because a host takes as many addresses of its
/// network as it likes (RFC 4291 2.5.4, RFC 8981).
class HostKey {
  public:
    HostKey() = default;
    /// `address`: without port; IPv4 also as ::ffff:10.0.0.7. Another text is a key of its own.
    explicit HostKey(std::string_view address);

    /// "10.0.0.7", "2001:db8:1:2::/64", "::1"; empty without an address.
    const std::string& text() const { return text_; }
    friend auto operator<=>(const HostKey&, const HostKey&) = default;

  private:
    std::string text_;
};

/// An IPv4 address as a listener on [::] sees it, ::ffff:10.0.0.7 (RFC 4291 2.5.5.2), becomes
/// 10.0.0.7; other texts are returned as they are.
std::string_view without_mapping(std::string_view address);

/// The address in a client's name ("modbus_tcp 10.0.0.7:51234", "[::1]:51234", "http ::1 token
/// ops"), which is its first or second word; empty for other names.
std::string_view address_in(std::string_view client);
/// A client's name with HostKey::text() in place of address and port: the same for all connections
/// of one host. Other names are returned as they are.
std::string name_of_host(std::string_view client);

}  // namespace panelgate
