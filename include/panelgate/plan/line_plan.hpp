#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/plan/line.hpp"

namespace panelgate::plan {

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

}  // namespace panelgate::plan
