#pragma once

#include <cstdint>
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
    loss     ///< line, process and clients come and go
};
inline constexpr HouseKind kHouseKinds[] = {HouseKind::calm, HouseKind::sound,  HouseKind::faulty,
                                            HouseKind::dead, HouseKind::memory, HouseKind::loss};
std::string_view label(HouseKind kind);

/// One run of the house: a line with its panels and clients as in a Plan, and what stands between.
struct HousePlan {
    Plan line;
    bool calm = false;
    Duration wake{};               ///< the loop looks this much later, at most, at what has come
    Duration take{};               ///< a client takes its replies this much later, at most
    std::vector<Duration> polled;  ///< by panel: how often
    bool relay = false;            ///< from the first panel to the last
    Duration length = 20s;
};
/// The same seed gives the same run.
HousePlan draw_house(HouseKind kind, std::uint64_t seed);

}  // namespace panelgate::scenario
