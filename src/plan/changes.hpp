#pragma once

#include <optional>
#include <string>

#include "panelgate/plan/line.hpp"
#include "panelgate/plan/line_plan.hpp"

namespace panelgate::plan {

/// Something that could be done, and the line on which it is done.
struct Change {
    std::string what;
    Line line;
};

/// Another rate: the lowest that is enough, else the highest that all panels have.
std::optional<Change> quicker(const Line& line);
/// The dearest read alone, where that is enough and it need not become ten times as rare. What is
/// changed is all that is asked of this station from its first item to its last.
std::optional<Change> dearest_read_rarer(const Line& line, const LinePlan& plan);
/// All intervals by one factor; a refresh of a relay stays.
std::optional<Change> all_rarer(const Line& line, const LinePlan& plan);
/// One relay in the place of several. Points and poll blocks are joined anyway.
std::optional<Change> fewer_relays(const Line& line);

}  // namespace panelgate::plan
