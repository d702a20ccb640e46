#pragma once

#include <string>
#include <vector>

#include "panelgate/plan/line.hpp"
#include "panelgate/plan/line_plan.hpp"

namespace panelgate::plan {

/// What cannot do however idle the line is, and what to change: panels that are planned to answer
/// after their timeout, and a request that is so long that with one other before it the queue's
/// deadline passes. `plan` is the line's.
std::vector<std::string> warnings(const Line& line, const LinePlan& plan);

}  // namespace panelgate::plan
