#pragma once

#include <cstddef>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::tap {

struct Settings {
    SerialFormat serial;
    /// The longest silence inside a frame, as it is heard here: adapters and busy machines put
    /// pauses anywhere. Nobody waits for a tap: where the line goes on, what follows tells sooner.
    Duration hole = 250ms;
    /// A request without an answer is given up by then, whatever its master does.
    Duration patience = 10s;
    /// How long after its request a reply may still come, although its master has gone on.
    Duration late_window = 5s;
    /// Where nothing was learned yet, a frame that may be an echo or the same request once more is
    /// the request behind this.
    Duration usual_give_up = 1s;
    std::size_t owed = 4;           ///< unanswered requests of a station that are remembered
    std::size_t damaged_run = 512;  ///< bytes: longer ones are told in pieces
};

}  // namespace panelgate::tap
