#pragma once

#include <cstddef>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::tap {

struct Settings {
    SerialFormat serial;
    /// The longest silence inside a frame, as received here: adapters and busy machines cause
    /// pauses anywhere (T4). If the line continues, the following bytes decide sooner.
    Duration hole = 250ms;
    /// A request without reply is closed after this time, even if the master asks nothing else.
    Duration patience = 10s;
    /// How long after its request a reply may still come, although the master has gone on (T2), and
    /// how long after a broadcast a panel may answer the broadcast (T11).
    Duration late_window = 5s;
    /// A frame that equals its request, or looks like a request, is no copy of the request within
    /// this time: no master gives up sooner. minimalmodbus waits 50 ms, libmodbus 500 ms.
    Duration least_give_up = 50ms;
    /// After this time the same frame is the next request: most masters have given up by then (T1).
    Duration usual_give_up = 1s;
    /// A line that has returned a read (T6) may return writes for this time.
    Duration echo_memory = 1min;
    std::size_t damaged_run = 512;  ///< bytes: longer runs of damage are reported in pieces
};

}  // namespace panelgate::tap
