#pragma once

#include <cstddef>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

struct QueueSettings {
    std::size_t limit = 256;      ///< requests that wait on this line
    std::size_t per_client = 32;  ///< of one client
    Duration deadline = 2s;       ///< of a request, from its arrival to its answer
    friend bool operator==(const QueueSettings&, const QueueSettings&) = default;
};

}  // namespace panelgate::arbiter
