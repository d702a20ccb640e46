#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/tcp_server/counters.hpp"
#include "shared.hpp"

namespace panelgate::tcp_server {

/// What the gateway reports about itself, from one listener's view.
struct Diagnostics {
    struct Line {
        std::string name;
        bool up = false;
        std::size_t queue_depth = 0;
        double load_percent = 0;
    };
    struct Station {
        Health state = Health::unknown;
        std::optional<std::size_t> line;  ///< index in `lines`; nullopt: on another listener's line
        std::uint8_t id = 0;
        std::optional<Duration> last_answer;  ///< how long ago
        OutcomeCounts outcomes;               ///< of all clients
    };

    Duration uptime{};
    std::vector<Line> lines;  ///< of this listener, in the order of its settings
    Counters counters;
    std::string version;
    std::string url;   ///< of the web interface; may be empty
    std::string host;  ///< host name; may be empty
    /// Returns the configured station behind a unit, nullopt if there is none. May be null.
    std::function<std::optional<Station>(std::uint8_t unit)> station;
};

/// Returns the diagnostics unit's reply. Never uses a bus. Pure.
///
/// 02, 03 and 04 read the map that describe_register_map() documents; 2B/0E identifies the gateway
/// (AP 6.21). Every other function, including those for serial lines only (SER-01), is exception
/// 01; a malformed request of these functions 03.
Bytes answer_diagnostics(ByteView request, const Diagnostics& state);

/// Returns the gateway's current state as `who` may see it: a line or station of which he may read
/// nothing is as one that is not there. `shared` must outlive the result.
Diagnostics own_state(const Shared& shared, WhoRef who);

}  // namespace panelgate::tcp_server
