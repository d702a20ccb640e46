#pragma once

#include <cstdint>
#include <map>

namespace panelgate::web {

struct Counters {
    std::map<unsigned, std::uint64_t> requests;  ///< answered, by status
    std::uint64_t login_failures = 0;            ///< requests with an unknown token
};

}  // namespace panelgate::web
