#pragma once

#include <cstddef>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::tap {

struct Settings {
    SerialFormat serial;
    /// The longest silence inside a frame, as received here: adapters and busy machines cause
    /// pauses anywhere. If the line continues, the following bytes decide sooner.
    Duration hole = 250ms;
    /// An unanswered request is given up after this, whatever its master does.
    Duration patience = 10s;
    /// How long after its request a reply may still come, although its master has gone on.
    Duration late_window = 5s;
    /// A station that has sent more than it was asked for may do so again, for so long.
    Duration surplus_memory = 1min;
    /// Until a timeout was learned: a frame that may be an echo or a repeated request is the
    /// request after this time.
    Duration usual_give_up = 1s;
    std::size_t unanswered = 4;     ///< unanswered requests remembered per station
    std::size_t damaged_run = 512;  ///< bytes: longer runs are reported in pieces
};

}  // namespace panelgate::tap
