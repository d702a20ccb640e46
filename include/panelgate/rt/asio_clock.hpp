#pragma once

#include <cstdint>

#include "panelgate/base/time.hpp"

namespace panelgate::rt {

/// The machine's monotonic clock. With wall_seconds() the only place that asks it.
TimePoint now();
/// Wall clock: seconds since 1970, for log lines, metrics and panels' clocks; never for timing.
double wall_seconds();
/// The same as local time, as if it were UTC: what a clock on the wall shows.
std::int64_t local_wall_seconds();

}  // namespace panelgate::rt
