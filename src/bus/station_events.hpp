#pragma once

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/bus/bus.hpp"

namespace panelgate::bus {

/// One line in the log, with what to do about it.
void log_event(const Settings& settings, const arbiter::StationEvent& event);

}  // namespace panelgate::bus
