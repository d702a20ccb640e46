#pragma once

#include "loader.hpp"
#include "panelgate/points/point.hpp"

namespace panelgate::config {

/// Warns of what is legal and does nothing: a limit of what nobody may write, an order of words
/// where there is only one.
void warn_of_idle_keys(Loading& loading, yaml::MapReader& in, const points::Point& point);

}  // namespace panelgate::config
