#include "panelgate/base/priority.hpp"

#include <cstdlib>

namespace panelgate {

std::string_view label(PriorityClass priority) {
    switch (priority) {
        case PriorityClass::write:
            return "write";
        case PriorityClass::read:
            return "read";
        case PriorityClass::poll:
            return "poll";
        case PriorityClass::probe:
            return "probe";
    }
    std::abort();
}

}  // namespace panelgate
