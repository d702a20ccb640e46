#pragma once

#include <string_view>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/bus/bus.hpp"

namespace panelgate::bus {

/// "offline", "online", "late", "drift", "collision", "echo"
std::string_view label(arbiter::StationEvent::Kind kind);
/// One line in the log, with what to do about it.
void log_event(const Settings& settings, const arbiter::StationEvent& event);

}  // namespace panelgate::bus
