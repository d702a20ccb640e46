#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace panelgate::web {

struct Counters {
    std::map<unsigned, std::uint64_t> requests;  ///< answered, by status
    std::uint64_t login_failures = 0;            ///< requests with an unknown token
    std::map<std::string, double> token_uses{};  ///< last use of each, in seconds since 1970
};

}  // namespace panelgate::web
