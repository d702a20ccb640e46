#pragma once

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <string>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/plan/advice.hpp"
#include "panelgate/plan/line_plan.hpp"

namespace panelgate::app {

/// What a line has to carry, and what would help where that is too much.
struct Capacity {
    plan::Line line;
    plan::LinePlan plan;
    std::vector<plan::Advice> advice;
    std::vector<std::string> warnings;  ///< of requests that cannot do at any load
};

/// Of each line, in the order of the configuration, which outlives them. A line that is only
/// listened to carries nothing of ours.
std::vector<Capacity> capacities(const config::Config& config);

/// "line floor1 is planned to be busy for 93 % …; …": what is wrong, and what helps most.
std::string overload_text(const Capacity& capacity);
/// The plan of one line, in some lines.
std::string plan_text(const Capacity& capacity);
/// The members that it adds to a line of inventory_json(); `polls` takes the place of the one
/// there.
void add_plan(boost::json::object& line, const Capacity& capacity);

}  // namespace panelgate::app
