#pragma once

#include "families.hpp"
#include "panelgate/metrics/exposition.hpp"

namespace panelgate::metrics {

/// Nothing when there is no HTTP server.
void add_http(Families& out, const Snapshot& snapshot);

}  // namespace panelgate::metrics
