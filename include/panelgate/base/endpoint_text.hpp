#pragma once

#include <cstdint>
#include <string>

namespace panelgate {

/// "127.0.0.1:502"; an IPv6 address stands in brackets: "[::1]:502".
inline std::string endpoint_text(const std::string& address, std::uint16_t port) {
    const bool six = address.find(':') != std::string::npos;
    return (six ? '[' + address + ']' : address) + ':' + std::to_string(port);
}

}  // namespace panelgate
