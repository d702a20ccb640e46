#pragma once

#include <vector>

#include "rules.hpp"

namespace panelgate::explorer {

/// Partitions of what can happen, so that each is explored to some depth.
std::vector<Rules> small_worlds();

}  // namespace panelgate::explorer
