#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::tcp_server {

/// What the gateway tells about itself.
struct Diagnostics {
    struct Line {
        bool up = false;
        std::size_t queue_depth = 0;
        double load_percent = 0;
    };
    Duration uptime{};
    std::vector<Line> lines;  ///< of this listener, in the order of its settings
    std::string version;
};

/// The reply of the diagnostics unit. Never touches a bus. Pure.
///
/// 03 and 04 read one register map (input and holding registers alike):
///
///     0           version of this map: 1
///     1           number of lines N of this listener
///     2, 3        uptime in seconds, high word first
///     4 + 3i      line i (from 0, in the order of the configuration): 1 up, 0 down
///     5 + 3i      its queue depth, at most 65535
///     6 + 3i      its load in 0.1 % of the wire, at most 65535
///
/// Anything beyond is exception 02. 2B/0E is the basic device identification (AP 6.21): vendor,
/// product code, version. Every other function is exception 01, also those that only a serial
/// device has (SER-01); a malformed one of the three 03.
Bytes answer_diagnostics(ByteView request, const Diagnostics& state);

}  // namespace panelgate::tcp_server
