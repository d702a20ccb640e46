#pragma once

#include <cstdint>
#include <string>

namespace panelgate::tcp_server {

struct Counters {
    std::string listener;           ///< as configured: "127.0.0.1:1502"
    std::uint64_t connections = 0;  ///< open now
    std::uint64_t connections_total = 0;
    std::uint64_t protocol_errors = 0;
};

}  // namespace panelgate::tcp_server
