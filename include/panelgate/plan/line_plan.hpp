#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
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

// Loads are shares of the wire's time: 0.8 is 80 %; more than 1 is more than there is.

inline constexpr double kHigh = 0.8;         ///< above: clients wait long, and a fault is felt
inline constexpr double kFull = 1;           ///< above: polls are late for ever
inline constexpr double kProbes = 0.05;      ///< what all dead stations together may cost (P4)
inline constexpr unsigned kClientRead = 10;  ///< registers of the read that headroom is counted in

/// A request that goes out again and again.
struct Poll {
    std::string station;
    std::string read;  ///< the first item in the panel's notation
    std::uint32_t count = 1;
    std::vector<std::size_t> asked;  ///< what it serves: indices into its Station::asked
    Duration every{};
    Duration wire{};  ///< request, both gaps, think time, reply
    double load = 0;
};

/// What a relay asks on this line.
struct RelayLoad {
    enum class Request : std::uint8_t {
        read,
        write,
        reread  ///< polls of the target that each write makes old: all of them in one figure
    };
    std::string relay;
    std::string station;
    Request request = Request::read;
    Duration every{};  ///< of a write that waits for changes: its refresh
    Duration wire{};
    double load = 0;
    double most = 0;  ///< when the values change at every turn
};

/// The station whose silence leaves the others least.
struct OneDead {
    std::string station;
    double load = 0;   ///< of the others, and of all probes
    Duration holds{};  ///< the others wait so long, once, whoever falls silent
};

struct LinePlan {
    std::string line;
    std::vector<Poll> polls;
    std::vector<RelayLoad> relays;
    double load = 0;
    double most = 0;              ///< when all values change that relays wait for
    std::optional<OneDead> dead;  ///< nothing without stations that are asked
    bool listens = false;         ///< nothing is ever sent, for nobody
    Duration once{};              ///< everything, one after the other
    Duration client_read = 1ms;   ///< of kClientRead registers, of the slowest station

    /// Of the time, for whoever asks besides.
    double free_share() const;
    /// Reads of kClientRead registers a second that the wire has time for besides.
    double free_reads() const;
};

enum class Verdict : std::uint8_t { fine, high, overload };
std::string_view label(RelayLoad::Request request);
/// Of the load that is certain; what relays may add makes it `high` at most, above kFull.
Verdict verdict(const LinePlan& plan);
/// The verdict is not `fine` for what relays may add alone: `most` is what is too much.
bool is_high_by_changes(const LinePlan& plan);

LinePlan make_plan(const Line& line);

struct HighestRate {
    double times = 1;       ///< as often as now everything could be asked
    bool changing = false;  ///< beyond, the values that change are too many; else what is certain
};

/// Up to which all that a line has to carry is fine, found by planning it at other intervals; a
/// refresh of a relay stays. Nothing of an idle line. `plan` is the line's.
std::optional<HighestRate> highest_rate(const Line& line, const LinePlan& plan);

/// To whole milliseconds of up to two digits, which people would choose.
inline Duration rounded_up(Duration duration) {
    Duration unit = 1ms;
    while (duration > 20 * unit) unit *= 10;
    return (duration + unit - Duration(1)) / unit * unit;
}

}  // namespace panelgate::plan
