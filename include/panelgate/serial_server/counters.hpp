#pragma once

#include <cstdint>
#include <string>

namespace panelgate::serial_server {

struct Counters {
    std::string master;            ///< its name in the configuration
    bool up = false;               ///< the device is open
    std::uint64_t requests = 0;    ///< to served units, broadcasts included
    std::uint64_t broadcasts = 0;  ///< of them
    std::uint64_t repeated = 0;    ///< retries that got the first one's answer
    std::uint64_t replies = 0;     ///< sent, exceptions included
    std::uint64_t exceptions = 0;  ///< of them
    std::uint64_t silent = 0;      ///< failures answered by silence
    std::uint64_t superseded = 0;  ///< dropped because the master sent again
    std::uint64_t late = 0;        ///< replies not sent: past the master's timeout
    std::uint64_t foreign = 0;     ///< good frames to and from units not served here
    std::uint64_t damaged = 0;     ///< byte runs without a good frame
    std::uint64_t reopens = 0;     ///< reopenings of the device
};

}  // namespace panelgate::serial_server
