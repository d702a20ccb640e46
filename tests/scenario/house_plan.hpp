#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"
#include "plan.hpp"

namespace panelgate::scenario {

enum class HouseKind : std::uint8_t {
    calm,    ///< sound panels that take all the time there is, one client, endless polls
    sound,   ///< sound panels, oddly spoken, and many clients
    faulty,  ///< replies that are late, damaged, foreign or missing
    dead,    ///< panels that die, alone and together
    memory,  ///< stations with max_age
    loss,    ///< line, process and clients come and go
    master   ///< a serial master beside the clients; the others have one now and then
};
inline constexpr HouseKind kHouseKinds[] = {HouseKind::calm,  HouseKind::sound,  HouseKind::faulty,
                                            HouseKind::dead,  HouseKind::memory, HouseKind::loss,
                                            HouseKind::master};
std::string_view label(HouseKind kind);

/// How a serial master goes on.
enum class Manner : std::uint8_t {
    libmodbus,  ///< something else each time; what is not answered in time is given up
    mbpoll,     ///< the same again and again
    impatient   ///< waits for less than a panel needs, then repeats or goes on
};

/// A serial master on a port of its own: chances are by request.
struct MasterPlan {
    Plan port;  ///< the wire between: its characters, and what comes back of the gateway's own
    Manner manner = Manner::libmodbus;
    Duration timeout = 500ms;
    Duration pause = 5ms;        ///< behind an answer, or a request that was given up
    bool tells_timeout = false;  ///< the gateway knows `timeout`
    bool on_failure_exception = false;
    double writes = 0.2;
    double broadcasts = 0;
    double others = 0;           ///< a slave of its own line is asked, and answers
    double damaged = 0;          ///< on the way
    double pieces = 0;           ///< with a pause inside
    double glitches = 0;         ///< a byte of noise behind it
    double talks_over = 0;       ///< does not wait for the reply, which may be leaving
    bool serves_others = false;  ///< the gateway is told to answer for that slave, too

    /// Nothing keeps the gateway from hearing and answering each request within this time.
    bool is_answered_within(Duration deadline) const {
        constexpr Duration kOnItsWire = 400ms;  // and in the device
        return damaged == 0 && pieces == 0 && glitches == 0 && talks_over == 0 &&
               on_failure_exception && timeout >= deadline + kOnItsWire;
    }
};

/// One run of the house: a line with its panels and clients as in a Plan, and what stands between.
struct HousePlan {
    Plan line;
    bool calm = false;
    Duration wake{};               ///< the loop looks this much later, at most, at what has come
    Duration take{};               ///< a client takes its replies this much later, at most
    std::vector<Duration> polled;  ///< by panel: how often
    bool relay = false;            ///< from the first panel to the last
    std::optional<MasterPlan> master;
    Duration length = 20s;
};
/// The same seed gives the same run.
HousePlan draw_house(HouseKind kind, std::uint64_t seed);

}  // namespace panelgate::scenario
