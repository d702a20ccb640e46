#include "panelgate/points/relay_status.hpp"

#include <cstdlib>

namespace panelgate::points {

std::string_view label(RelayState state) {
    switch (state) {
        case RelayState::waiting:
            return "waiting";
        case RelayState::ok:
            return "ok";
        case RelayState::source_failing:
            return "source failing";
        case RelayState::target_failing:
            return "target failing";
    }
    std::abort();
}

std::string text_of(const RelayStatus& relay) {
    std::string text(label(relay.state));
    return relay.why.empty() ? text : text + ": " + relay.why;
}

}  // namespace panelgate::points
