#include "panelgate/base/health.hpp"

#include <cstdlib>

namespace panelgate {

std::string_view label(Health health) {
    switch (health) {
        case Health::unknown:
            return "unknown";
        case Health::online:
            return "online";
        case Health::suspect:
            return "suspect";
        case Health::heard:
            return "heard";
        case Health::offline:
            return "offline";
    }
    std::abort();
}

}  // namespace panelgate
