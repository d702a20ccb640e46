#pragma once

#include <string>
#include <vector>

#include "panelgate/config/config.hpp"

namespace panelgate::app {

/// Units of a listener or serial master by which a client would now reach another panel: the line
/// of their station was taken away, its id or its alias has changed, stations are swapped. One
/// sentence each. Units that reach nobody now are not listed, nor a panel that only has another
/// name. Pure.
std::vector<std::string> moved_units(const config::Config& before, const config::Config& after);

}  // namespace panelgate::app
