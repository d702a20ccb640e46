#include "panelgate/base/outcome.hpp"

#include <cstdlib>

namespace panelgate {

std::string_view label(Outcome outcome) {
    switch (outcome) {
        case Outcome::ok:
            return "ok";
        case Outcome::exception:
            return "exception";
        case Outcome::timeout:
            return "timeout";
        case Outcome::damaged:
            return "damaged";
        case Outcome::refused:
            return "refused";
        case Outcome::busy:
            return "busy";
        case Outcome::expired:
            return "expired";
        case Outcome::cancelled:
            return "cancelled";
        case Outcome::offline:
            return "offline";
        case Outcome::line_down:
            return "line_down";
        case Outcome::cached:
            return "cached";
        case Outcome::shared:
            return "shared";
    }
    std::abort();
}

}  // namespace panelgate
