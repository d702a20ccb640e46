#pragma once

#include "loader.hpp"

namespace panelgate::config {

/// Whom a client of a listener, or on a serial port, may ask: `lines`, `units` and `access`. The
/// lines have been read already. Call it before what looks at the units.
void load_access(Loading& loading, yaml::MapReader& in, tcp_server::Settings& settings);
/// These keys with nothing behind them. Call it when all keys have been read.
void refuse_empty_access(yaml::MapReader& in);

}  // namespace panelgate::config
