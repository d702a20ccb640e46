#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace panelgate::config {

struct Endpoint {
    std::string address;  ///< IPv4 or IPv6, in text, without brackets
    std::uint16_t port = 0;
};

/// "127.0.0.1:502", "[::1]:502"; nothing on anything else (names are not looked up).
std::optional<Endpoint> parse_endpoint(std::string_view text);

/// Of an address that parse_endpoint() has taken.
bool is_ipv6(const std::string& address);
/// 0.0.0.0 or ::, in any spelling: all addresses of the machine.
bool is_any_address(const std::string& address);

/// "10.0.0.0/8" or a bare address: address and prefix length; nothing on anything else. Of an IPv4
/// address that is written as IPv6 (::ffff:10.0.0.1) the prefix is 96 at least: what is shorter
/// lets all of IPv4 in.
struct Cidr {
    std::string address;
    unsigned prefix = 0;
};
std::optional<Cidr> parse_cidr(std::string_view text);
/// "192.168.0.0/24" for 192.168.0.5/24; "" when the address is the first of its network.
std::string network_of(const Cidr& cidr);
/// Whether this network has the address, IPv4 as IPv6 too; what is no address is in none.
bool is_in(const std::string& address, const std::string& network, unsigned prefix);

/// Where a program on this machine reaches a listener: that of all addresses on loopback.
inline std::string reachable(const std::string& address) {
    if (!is_any_address(address)) return address;
    return is_ipv6(address) ? "::1" : "127.0.0.1";
}

}  // namespace panelgate::config
