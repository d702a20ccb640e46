#pragma once

#include <string>
#include <vector>

#include "panelgate/rt/settings.hpp"

namespace panelgate::rt {

/// Asks the system for what `settings` want, for the calling thread (and all memory), and for
/// sleeps that end on time beside programs that compute, which is free. A line for each wish that
/// was not granted: which, why, and what would grant it.
std::vector<std::string> be_punctual(const RealtimeSettings& settings);

}  // namespace panelgate::rt
