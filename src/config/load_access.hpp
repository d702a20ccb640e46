#pragma once

#include <vector>

#include "loader.hpp"

namespace panelgate::config {

/// Whom a client of a listener, or on a serial port, may ask: `lines`, `units` and `access`. The
/// lines have been read already. Call it before what looks at the units.
void load_access(Loading& loading, yaml::MapReader& in, tcp_server::Settings& settings);
/// These keys with nothing behind them. Call it when all keys have been read.
void refuse_empty_access(yaml::MapReader& in);

/// The key `hosts` of `http`: names and addresses, without ports.
void load_hosts(Loading& loading, yaml::MapReader& in, web::Settings& settings);

/// The key `tokens` of `http`. Secrets are read from their files.
void load_tokens(Loading& loading, yaml::MapReader& in, std::vector<web::Token>& tokens);

}  // namespace panelgate::config
