#pragma once

#include <cstdint>
#include <string>

#include "panelgate/tls/counters.hpp"

namespace panelgate::tcp_server {

struct Counters {
    std::string listener;           ///< as configured: "127.0.0.1:1502"
    std::uint64_t connections = 0;  ///< open now
    std::uint64_t connections_total = 0;
    std::uint64_t protocol_errors = 0;
    std::uint64_t requests = 0;    ///< accepted
    std::uint64_t joined = 0;      ///< retransmissions answered with the reply to the original
    std::uint64_t exceptions = 0;  ///< sent, including those from panels
    std::uint64_t busy = 0;        ///< exceptions 06
    std::uint64_t unanswered = 0;  ///< requests without a reply: unit 0 where broadcasts are silent
    std::uint64_t refused = 0;     ///< connections and datagrams: full, and none gives way
    std::uint64_t evicted = 0;     ///< connections closed for newer ones (find_place())
    tls::Counters tls{};
};

}  // namespace panelgate::tcp_server
