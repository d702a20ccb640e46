#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "panelgate/base/endpoint_text.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::web {

enum class Role : std::uint8_t { none, viewer, operator_ };

struct Token {
    std::string name;
    Role role = Role::viewer;
    std::string secret;  ///< read from its file at load
};

struct Settings {
    std::string address = "127.0.0.1";
    std::uint16_t port = 8080;  ///< 0: any free one
    bool ipv6_only = false;     ///< of "::": another listener has this port for IPv4
    Role anonymous = Role::viewer;
    std::vector<Token> tokens;
    std::size_t max_connections = 256;
    std::size_t max_body = 64 * 1024;  ///< bytes
    Duration idle_timeout = 60s;       ///< of a keep-alive connection
    Duration request_timeout = 10s;    ///< to receive one request, and to send one answer

    std::string name() const { return endpoint_text(address, port); }
};

}  // namespace panelgate::web
