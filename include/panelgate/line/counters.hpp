#pragma once

#include <cstdint>

namespace panelgate::line {

struct Counters {
    std::uint64_t reopens = 0;  ///< successful opens after the first
    std::uint64_t bytes_sent = 0;
    std::uint64_t bytes_received = 0;
};

}  // namespace panelgate::line
