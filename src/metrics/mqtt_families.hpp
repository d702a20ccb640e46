#pragma once

#include "families.hpp"
#include "panelgate/metrics/exposition.hpp"

namespace panelgate::metrics {

/// Of the broker; nothing without one.
void add_mqtt(Families& out, const Snapshot& snapshot);

}  // namespace panelgate::metrics
