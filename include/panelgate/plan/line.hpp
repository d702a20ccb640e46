#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/span.hpp"
#include "panelgate/points/read_plan.hpp"
#include "panelgate/points/station_polls.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::plan {

/// A point or a poll block, as the configuration has it.
struct Asked {
    points::Want want;
    std::string notation;  ///< as typed
};

struct Station {
    std::string name;
    const profile::PanelProfile* profile = nullptr;  ///< never null; outlives this
    Duration response_timeout = 500ms;
    Duration think_time = 1ms;
    /// Of the whole line behind its first timeout (`quarantine: line`); then its request is
    /// repeated before anybody else's, if it is.
    Duration line_rest{};
    bool repeats = true;
    /// Silence behind its replies, where it is set; nothing: what its rate and its profile ask for.
    std::optional<Duration> frame_gap;
    std::vector<Asked> asked;
    points::SharedMemory memory{};  ///< what is read again behind a write
};

/// What a relay does on one line. `from` and `to`: its ends that are on this line, one at least.
struct Relay {
    struct End {
        std::size_t station = 0;  ///< index into Line::stations
        modbus::Span span;
    };
    std::string name;
    Duration every = 1s;  ///< it reads, and writes; above 0
    /// It writes only what has changed, and all of it once so often; nothing: it always writes.
    std::optional<Duration> refresh;
    std::optional<End> from;
    std::optional<End> to;
    bool single = false;  ///< it writes by 05 or 06

    /// It writes so often at least, changed or not.
    Duration writes_every() const { return refresh ? std::max(every, *refresh) : every; }
    /// On this line it can be told whether `other` goes on where this one ends.
    bool continues_in(const Relay& other) const;
};

/// What is known of a line before anything runs.
struct Line {
    std::string name;
    SerialFormat serial;
    std::vector<Station> stations;
    std::vector<Relay> relays;
    Duration deadline = 2s;  ///< of a request, from its arrival to its answer
    bool listens = false;    ///< nothing is ever sent there
};

/// Silence behind the replies of one of its stations.
Duration gap_of(const Line& line, const Station& station);
/// What bounds a station's reads, and what they cost, on this line.
points::PlanLimits limits_of(const Line& line, const Station& station);
/// The same line at another rate. Gaps that are set stay.
Line at_rate(const Line& line, int baud);
/// The same line with every interval so many times as long (above 0), up to points::kSlowest;
/// `refresh` is none.
Line at_intervals(const Line& line, double times);

}  // namespace panelgate::plan
