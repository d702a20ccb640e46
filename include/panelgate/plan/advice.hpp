#pragma once

#include <string>
#include <vector>

#include "panelgate/plan/line_plan.hpp"

namespace panelgate::plan {

inline constexpr double kWorthwhile = 0.01;  ///< what brings less is no advice

struct Advice {
    std::string what;  ///< "serial: {baud: 38400}"
    double load = 0;   ///< of the line, then
    double most = 0;   ///< … while all values change that relays wait for
};

/// What to change on a line whose load is not fine, each by itself, what brings the most first:
/// of the load that is certain, or of `most` where only that is too much. `plan` is the line's.
std::vector<Advice> advise(const Line& line, const LinePlan& plan);

/// What cannot do however idle the line is, and what to change: panels that are planned to answer
/// after their timeout, and a request that is so long that with one other before it the queue's
/// deadline passes. `plan` is the line's.
std::vector<std::string> warnings(const Line& line, const LinePlan& plan);

}  // namespace panelgate::plan
