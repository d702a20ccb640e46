#include "panelgate/base/echo_state.hpp"

#include <cstdlib>

namespace panelgate {

std::string_view label(EchoState state) {
    switch (state) {
        case EchoState::unknown:
            return "unknown";
        case EchoState::absent:
            return "absent";
        case EchoState::present:
            return "present";
        case EchoState::unclear:
            return "unclear";
    }
    std::abort();
}

}  // namespace panelgate
