#pragma once

#include <string>

#include "panelgate/config/endpoint.hpp"

namespace panelgate::config {

/// Where a program on this machine reaches a listener: that of all addresses on loopback.
inline std::string reachable(const std::string& address) {
    if (!is_any_address(address)) return address;
    return is_ipv6(address) ? "::1" : "127.0.0.1";
}

}  // namespace panelgate::config
