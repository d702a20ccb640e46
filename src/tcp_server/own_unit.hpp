#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/tcp_server/counters.hpp"
#include "shared.hpp"

namespace panelgate::tcp_server {

/// What the gateway tells about itself: all of it as one listener sees it.
struct Diagnostics {
    struct Line {
        std::string name;
        bool up = false;
        std::size_t queue_depth = 0;
        double load_percent = 0;
    };
    struct Station {
        Health state = Health::unknown;
        std::optional<std::size_t> line;  ///< index in `lines`; nothing: not of this listener
        std::uint8_t id = 0;
        std::optional<Duration> last_answer;  ///< how long ago
        OutcomeCounts outcomes;               ///< of all who ask
    };

    Duration uptime{};
    std::vector<Line> lines;  ///< of this listener, in the order of its settings
    Counters counters;
    std::string version;
    std::string url;   ///< of its pages; may be empty
    std::string host;  ///< name of the machine; may be empty
    /// The listed station behind a unit; nothing: there is none. May be left out.
    std::function<std::optional<Station>(std::uint8_t unit)> station;
};

/// The reply of the diagnostics unit. Never touches a bus. Pure.
///
/// 02, 03 and 04 read the map of register_map.hpp; 08 gives its counters (AP 6.8), 11 and 17 answer
/// for the gateway, 2B/0E has the objects of identification.hpp. Every other function is exception
/// 01, also those that only a serial device has (SER-01); a malformed one of these 03.
Bytes answer_diagnostics(ByteView request, const Diagnostics& state);

/// What the gateway tells of itself now. `shared` outlives it.
Diagnostics own_state(const Shared& shared);

}  // namespace panelgate::tcp_server
