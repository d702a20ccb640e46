#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "panelgate/tls/counters.hpp"

namespace panelgate::web {

struct Counters {
    std::map<unsigned, std::uint64_t> requests;  ///< answered, by status
    std::uint64_t login_failures = 0;            ///< requests with an unknown token
    std::map<std::string, double> token_uses{};  ///< last use of each, in seconds since 1970
    std::string listener{};                      ///< as configured: "127.0.0.1:8080"
    tls::Counters tls{};
};

}  // namespace panelgate::web
