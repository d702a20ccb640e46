#include "panelgate/arbiter/actions.hpp"

#include <cstdlib>

namespace panelgate::arbiter {

std::string_view label(StationEvent::Kind kind) {
    switch (kind) {
        case StationEvent::Kind::offline:
            return "offline";
        case StationEvent::Kind::online:
            return "online";
        case StationEvent::Kind::suspect:
            return "suspect";
        case StationEvent::Kind::heard:
            return "heard";
        case StationEvent::Kind::unknown:
            return "unknown";
        case StationEvent::Kind::late:
            return "late";
        case StationEvent::Kind::drift:
            return "drift";
        case StationEvent::Kind::collision:
            return "collision";
        case StationEvent::Kind::echo:
            return "echo";
        case StationEvent::Kind::trail:
            return "trail";
    }
    std::abort();
}

}  // namespace panelgate::arbiter
