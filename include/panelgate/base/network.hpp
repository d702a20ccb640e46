#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace panelgate {

/// A network in CIDR form; a bare address is /32 or /128.
struct Network {
    std::string address;
    unsigned prefix = 0;
    friend bool operator==(const Network&, const Network&) = default;
};

/// An IPv6 address; an IPv4 one as ::ffff:10.0.0.1 (RFC 4291, 2.5.5.2).
using AddressBytes = std::array<std::uint8_t, 16>;
/// The same in their first so many bits, 128 at most.
bool same_prefix(const AddressBytes& left, const AddressBytes& right, unsigned bits);

}  // namespace panelgate
