#pragma once

#include "families.hpp"
#include "panelgate/metrics/exposition.hpp"

namespace panelgate::metrics {

void add_points(Families& out, const Snapshot& snapshot);
void add_relays(Families& out, const Snapshot& snapshot);

}  // namespace panelgate::metrics
