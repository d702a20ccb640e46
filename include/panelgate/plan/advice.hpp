#pragma once

#include <string>
#include <vector>

#include "panelgate/plan/line.hpp"
#include "panelgate/plan/line_plan.hpp"

namespace panelgate::plan {

struct Advice {
    std::string what;  ///< "serial: {baud: 38400}"
    double load = 0;   ///< of the line, then
};

/// What to change on a line whose load is not fine, each by itself. `plan` is the line's.
std::vector<Advice> advise(const Line& line, const LinePlan& plan);

}  // namespace panelgate::plan
