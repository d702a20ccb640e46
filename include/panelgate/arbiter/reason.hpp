#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "panelgate/arbiter/client_names.hpp"
#include "panelgate/base/priority.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// Why a frame is sent now. It becomes words only when somebody reads them.
struct Reason {
    enum class Kind : std::uint8_t {
        none,         ///< nobody wants to know, or nobody here has sent it
        learns_echo,  ///< a write is next, and this read finds out about the echo
        probe,
        again,  ///< another attempt
        turn,   ///< it was next
    };
    Kind kind = Kind::none;
    PriorityClass priority = PriorityClass::read;
    std::uint8_t station = 0;
    std::uint8_t asked_function = 0;  ///< what it stands for; 0: its own
    bool passed_over = false;         ///< ahead of a higher class, which had had its turns
    int attempt = 1;
    Duration waited{};
    std::size_t waiting = 0;  ///< behind it, on the whole line
    std::size_t answers = 0;  ///< requests
    ClientName client{};      ///< who wants it
};

/// One line, or "" for none.
std::string text_of(const Reason& reason);

}  // namespace panelgate::arbiter
