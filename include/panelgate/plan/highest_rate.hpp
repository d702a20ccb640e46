#pragma once

#include <optional>

#include "panelgate/plan/line.hpp"
#include "panelgate/plan/line_plan.hpp"

namespace panelgate::plan {

struct HighestRate {
    double times = 1;       ///< as often as now everything could be asked
    bool changing = false;  ///< beyond, the values that change are too many; else what is certain
};

/// Up to which all that a line has to carry is fine, found by planning it at other intervals; a
/// refresh of a relay stays. Nothing of an idle line. `plan` is the line's.
std::optional<HighestRate> highest_rate(const Line& line, const LinePlan& plan);

}  // namespace panelgate::plan
