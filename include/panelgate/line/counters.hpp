#pragma once

#include <cstdint>
#include <optional>

namespace panelgate::line {

/// Counters of the UART's driver since this program first opened it (TIOCGICOUNT).
struct UartErrors {
    std::uint64_t framing = 0;   ///< missing stop bit: wrong baud, noise
    std::uint64_t parity = 0;    ///< wrong parity bit
    std::uint64_t overruns = 0;  ///< bytes lost in the UART or in the driver's buffer
    std::uint64_t breaks = 0;    ///< the line was low for longer than a character
    friend bool operator==(const UartErrors&, const UartErrors&) = default;
};

struct Counters {
    std::uint64_t reopens = 0;  ///< successful opens after the first
    std::uint64_t bytes_sent = 0;
    std::uint64_t bytes_received = 0;
    std::optional<UartErrors> uart;  ///< if the driver counts them
    bool telnet = false;  ///< no count: the last connection began with telnet's negotiation
};

}  // namespace panelgate::line
