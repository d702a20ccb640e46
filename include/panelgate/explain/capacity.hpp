#pragma once

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/plan/line_plan.hpp"

namespace panelgate::explain {

/// The planned load of a line, and what helps where it is too high.
struct Capacity {
    plan::Line line;
    plan::LinePlan plan;
    std::optional<plan::Advice> advice;
    std::vector<std::string> warnings;  ///< about requests that cannot work at any load
};

/// The capacity of each line, in the order of the configuration, which must outlive them. A line
/// that is only listened to has no load of ours.
std::vector<Capacity> capacities(const config::Config& config);

/// "line floor1 is planned to be busy for 93 % …; …": the overload and what helps.
std::string overload_text(const Capacity& capacity);
/// The plan of one line as text, several lines long.
std::string plan_text(const Capacity& capacity);
/// Adds the plan's members to a line of inventory_json(); its `polls` replaces the one there.
void add_plan(boost::json::object& line, const Capacity& capacity);

}  // namespace panelgate::explain
