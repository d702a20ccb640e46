#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/network.hpp"

namespace panelgate::config {

struct Endpoint {
    std::string address;  ///< IPv4 or IPv6 as text, without brackets
    std::uint16_t port = 0;
};

/// Parses "127.0.0.1:502" or "[::1]:502"; returns nothing for anything else (names are not looked
/// up).
std::optional<Endpoint> parse_endpoint(std::string_view text);

/// True if an address accepted by parse_endpoint() is IPv6.
bool is_ipv6(const std::string& address);
/// True for 0.0.0.0 and :: in any spelling: all addresses of the machine.
bool is_any_address(const std::string& address);
/// True for an address that only programs on this machine reach: 127.0.0.0/8 and ::1.
bool is_loopback(const std::string& address);

/// Parses "10.0.0.0/8", or a bare address. Returns nothing for anything else, nor for a prefix
/// below 96 of an IPv4 address written as IPv6 (::ffff:10.0.0.1), which would let all of IPv4 in.
std::optional<Network> parse_cidr(std::string_view text);
/// "10.0.0.0/8"
std::string network_text(const Network& network);
/// Returns "192.168.0.0/24" for 192.168.0.5/24; "" if the address is the first of its network.
std::string network_of(const Network& typed);
/// True if the network contains the address; IPv4 also matches its IPv6 form. False for invalid
/// text.
bool is_in(const std::string& address, const std::string& network, unsigned prefix);

/// True if all addresses of `narrow` are in `wide`.
bool covers(const Network& wide, const Network& narrow);

/// True if more than known networks reach a listener on this address: it is not on loopback, and
/// `allow` is empty or has more public addresses than one /8 of IPv4 or one /16 of IPv6, its
/// networks taken together.
bool is_reachable_from_outside(const std::string& address, const std::vector<Network>& allow);

/// Returns the address at which a program on this machine reaches a listener: loopback if it
/// listens on all addresses.
inline std::string reachable(const std::string& address) {
    if (!is_any_address(address)) return address;
    return is_ipv6(address) ? "::1" : "127.0.0.1";
}

}  // namespace panelgate::config
