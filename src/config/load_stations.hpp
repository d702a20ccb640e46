#pragma once

#include "loader.hpp"

namespace panelgate::config {

/// Reads a line's `timing`, `retries` and `stations` and resolves the timing of every station. The
/// line's serial format is known already.
void load_stations(Loading& loading, yaml::MapReader& in, Line& line);

}  // namespace panelgate::config
