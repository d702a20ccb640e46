#pragma once

#include <cstdint>
#include <string>

namespace panelgate::serial_server {

struct Counters {
    std::string master;            ///< its name in the configuration
    bool up = false;               ///< its device is open
    std::uint64_t requests = 0;    ///< to units that are served here, broadcasts included
    std::uint64_t broadcasts = 0;  ///< of them
    std::uint64_t repeated = 0;    ///< of them, those that got the answer of the same one before
    std::uint64_t replies = 0;     ///< sent, exceptions included
    std::uint64_t exceptions = 0;  ///< of them
    std::uint64_t silent = 0;      ///< failures that were told by silence
    std::uint64_t superseded = 0;  ///< given up: the master had begun to talk again
    std::uint64_t late = 0;        ///< replies that would have begun behind its timeout
    std::uint64_t foreign = 0;     ///< good frames to and of units that are not served here
    std::uint64_t damaged = 0;     ///< bytes that became no good frame, counted once a frame
    std::uint64_t reopens = 0;     ///< of the device, after the first time
};

}  // namespace panelgate::serial_server
