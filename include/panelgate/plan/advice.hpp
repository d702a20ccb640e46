#pragma once

#include <string>
#include <vector>

#include "panelgate/plan/line_plan.hpp"

namespace panelgate::plan {

inline constexpr double kMinGain = 0.01;  ///< smallest reduction of load worth an advice

struct Advice {
    std::string what;  ///< "serial: {baud: 38400}"
    double load = 0;   ///< the line's load after the change
    double most = 0;   ///< … with all values changing that relays wait for
};

/// Returns single changes for a line whose load is not fine, the most effective first: by `load`,
/// or by `most` if only that is too high. `plan` is the line's plan.
std::vector<Advice> advise(const Line& line, const LinePlan& plan);

/// Returns warnings of what fails even on an idle line, with the remedy: panels whose planned reply
/// comes after their timeout, panels that rest for longer than their polls and relays allow, and a
/// request so long that, with one other before it, it misses the
/// queue's deadline. `plan` is the line's plan.
std::vector<std::string> warnings(const Line& line, const LinePlan& plan);

}  // namespace panelgate::plan
