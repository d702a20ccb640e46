#include "panelgate/base/frame_kind.hpp"

#include <cstdlib>

namespace panelgate {

FrameDirection direction_of(FrameKind kind) {
    switch (kind) {
        case FrameKind::request:
        case FrameKind::retry:
        case FrameKind::probe:
        case FrameKind::learn_echo:
        case FrameKind::broadcast:
            return FrameDirection::sent;
        case FrameKind::reply:
        case FrameKind::heard_request:
            return FrameDirection::received;
        case FrameKind::damaged:
        case FrameKind::echo:
        case FrameKind::foreign_request:
        case FrameKind::late:
        case FrameKind::copy:
        case FrameKind::foreign:
            return FrameDirection::discarded;
    }
    std::abort();
}

std::string_view label(FrameKind kind) {
    switch (kind) {
        case FrameKind::request:
            return "request";
        case FrameKind::retry:
            return "retry";
        case FrameKind::probe:
            return "probe";
        case FrameKind::learn_echo:
            return "learn echo";
        case FrameKind::broadcast:
            return "broadcast";
        case FrameKind::reply:
            return "reply";
        case FrameKind::heard_request:
            return "heard request";
        case FrameKind::damaged:
            return "damaged";
        case FrameKind::echo:
            return "echo";
        case FrameKind::foreign_request:
            return "foreign request";
        case FrameKind::late:
            return "late";
        case FrameKind::copy:
            return "copy";
        case FrameKind::foreign:
            return "foreign";
    }
    std::abort();
}

std::string_view label(FrameDirection direction) {
    switch (direction) {
        case FrameDirection::sent:
            return "sent";
        case FrameDirection::received:
            return "received";
        case FrameDirection::discarded:
            return "discarded";
    }
    std::abort();
}

}  // namespace panelgate
