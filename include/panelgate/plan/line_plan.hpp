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

/// A point or a poll block from the configuration.
struct PolledItem {
    points::Want want;
    std::string notation;  ///< as configured
};

struct Station {
    std::string name;
    const profile::PanelProfile* profile = nullptr;  ///< never null; outlives this
    Duration response_timeout = 500ms;
    Duration think_time = 1ms;
    /// How long the whole line is suspended after the station's first timeout (`quarantine: line`);
    /// the request is then repeated before any other, if `repeats`.
    Duration line_rest{};
    bool repeats = true;
    /// Silence after its replies, if configured; nullopt: from the serial format and the profile.
    std::optional<Duration> frame_gap;
    Duration
        station_gap{};  ///< rest of the station behind a reply; other stations are asked meanwhile
    Duration after_write{};  ///< the same behind a write
    std::vector<PolledItem> asked;
    points::SharedMemory memory{};  ///< decides what is read again after a write
};

/// A relay's part on one line. `from` and `to`: the relay's ends on this line, at least one end.
struct Relay {
    struct End {
        std::size_t station = 0;  ///< index into Line::stations
        modbus::Span span;
    };
    std::string name;
    Duration every = 1s;  ///< interval of reads and writes; above 0
    /// Writes only changes, and everything once per `refresh`; nullopt: writes at each turn.
    std::optional<Duration> refresh;
    std::optional<End> from;
    std::optional<End> to;
    bool single = false;  ///< writes by 05 or 06

    /// Returns the longest interval between writes.
    Duration writes_every() const { return refresh ? std::max(every, *refresh) : every; }
};

/// The static data of a line.
struct Line {
    std::string name;
    SerialFormat serial;
    std::vector<Station> stations;
    std::vector<Relay> relays;
    Duration deadline = 2s;  ///< of a request, from arrival to answer
    bool listens = false;    ///< listen mode: nothing is sent
};

/// Returns the line with every interval multiplied by `times` (above 0), up to points::kSlowest;
/// `refresh` stays.
Line at_intervals(const Line& line, double times);

// Loads are shares of the wire's time: 0.8 is 80 %; more than 1 is an overload.

inline constexpr double kHigh = 0.8;     ///< above: clients wait long, and faults are noticeable
inline constexpr double kFull = 1;       ///< above: polls are permanently late
inline constexpr double kProbes = 0.05;  ///< limit of all probes of offline stations together (P4)
inline constexpr unsigned kClientRead = 10;  ///< registers per read in which headroom is given

/// A periodic read.
struct Poll {
    std::string station;
    std::string read;  ///< first item in the panel's notation
    std::uint32_t count = 1;
    Duration every{};
    Duration wire{};  ///< request, both gaps, think time, reply
    double load = 0;
};

/// A relay's requests on this line.
struct RelayLoad {
    enum class Request : std::uint8_t {
        read,
        write,
        reread  ///< all polls of the target that each write makes outdated, summed
    };
    std::string relay;
    std::string station;
    Request request = Request::read;
    Duration every{};  ///< for on_change writes: the refresh
    Duration wire{};
    double load = 0;
    double most = 0;  ///< load if the values change at every turn
};

/// The station whose failure leaves the others the least time.
struct OneDead {
    std::string station;
    double load = 0;   ///< of the others, with all probes
    Duration holds{};  ///< longest single delay of the others when any station fails
};

struct LinePlan {
    std::string line;
    std::vector<Poll> polls;
    std::vector<RelayLoad> relays;
    double load = 0;
    double most = 0;              ///< load if all values change that relays wait for
    std::optional<OneDead> dead;  ///< nullopt without stations that are asked
    bool listens = false;         ///< listen mode: nothing is sent
    Duration once{};              ///< all requests, one after the other
    Duration client_read = 1ms;   ///< of kClientRead registers, from the slowest station

    /// Returns the share of time left for clients.
    double free_share() const { return listens ? 0 : std::max(0.0, kFull - load); }
    /// Returns the reads of kClientRead registers per second that fit into the time left.
    double free_reads() const { return free_share() / to_seconds(client_read); }
};

enum class Verdict : std::uint8_t { fine, high, overload };
std::string_view label(RelayLoad::Request request);
/// Judges `load`; `most` above kFull makes it `high` only.
Verdict verdict(const LinePlan& plan);
/// True if `load` is fine and only `most` is too high.
bool is_high_by_changes(const LinePlan& plan);

LinePlan make_plan(const Line& line);

struct HighestRate {
    double times = 1;       ///< factor on all request rates
    bool changing = false;  ///< the limit is `most`, not `load`
};

/// Returns the highest rate at which the line is still fine, found by planning it at other
/// intervals; a relay's refresh stays. nullopt for an idle line. `plan` is the line's plan.
std::optional<HighestRate> highest_rate(const Line& line, const LinePlan& plan);

/// A change that makes a line fine.
struct Advice {
    std::string what;  ///< "serial: {baud: 38400} (of all panels, too)"
    double load = 0;   ///< the line's load after the change
    double most = 0;   ///< … with all values changing that relays wait for
};

/// Returns what helps a line that is not fine: the next rate that all panels have and that is
/// enough, else longer intervals; nullopt for a line that is fine, or where neither helps. `plan`
/// is the line's plan.
std::optional<Advice> advise(const Line& line, const LinePlan& plan);

/// Returns warnings of what fails even on an idle line, with the remedy: panels whose planned reply
/// comes after their timeout, panels that rest for longer than their polls and relays allow, and a
/// request so long that, with one other before it, it misses the queue's deadline. `plan` is the
/// line's plan.
std::vector<std::string> warnings(const Line& line, const LinePlan& plan);

}  // namespace panelgate::plan
