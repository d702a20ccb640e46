#pragma once

#include "families.hpp"
#include "panelgate/metrics/exposition.hpp"

namespace panelgate::metrics {

/// Of masters on serial ports; nothing where there are none.
void add_serial_masters(Families& out, const Snapshot& snapshot);

}  // namespace panelgate::metrics
