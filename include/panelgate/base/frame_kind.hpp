#pragma once

#include <cstdint>
#include <string_view>

namespace panelgate {

/// What a frame on the wire is, for traces.
enum class FrameKind : std::uint8_t {
    // Sent
    request,
    retry,
    probe,       ///< is the station that was offline back?
    learn_echo,  ///< a read that shows whether the line hears itself
    broadcast,
    // Received, and what was waited for
    reply,
    heard_request,  ///< of the line's master, where the gateway only listens
    // Received and thrown away
    damaged,
    echo,             ///< of what was sent last
    foreign_request,  ///< another master's
    late,             ///< a reply whose request was given up
    copy,             ///< a reply once more
    foreign,          ///< a good frame that nobody asked for
};
enum class FrameDirection : std::uint8_t { sent, received, discarded };

FrameDirection direction_of(FrameKind kind);
std::string_view label(FrameKind kind);
std::string_view label(FrameDirection direction);

}  // namespace panelgate
