#pragma once

#include <cstdint>
#include <string>

namespace panelgate::tcp_server {

struct Counters {
    std::string listener;           ///< as configured: "127.0.0.1:1502"
    std::uint64_t connections = 0;  ///< open now
    std::uint64_t connections_total = 0;
    std::uint64_t protocol_errors = 0;
    std::uint64_t requests = 0;    ///< taken
    std::uint64_t joined = 0;      ///< retransmissions that get the answer of the first
    std::uint64_t exceptions = 0;  ///< answered, the panels' own included
    std::uint64_t busy = 0;        ///< exceptions 06
    std::uint64_t unanswered = 0;  ///< requests that get no answer: unit 0 where nobody is answered
    std::uint64_t refused = 0;     ///< connections: no place, and no idle one to give way
    std::uint64_t evicted = 0;     ///< idle connections that gave way to newer ones
};

}  // namespace panelgate::tcp_server
