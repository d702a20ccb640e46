#pragma once

#include <vector>

#include "loader.hpp"

namespace panelgate::config {

/// Reads which stations a client of a listener, or on a serial port, may access: `lines`, `units`
/// and `access`. Needs the lines loaded; call it before what uses the units.
void load_access(Loading& loading, yaml::MapReader& in, tcp_server::Settings& settings);
/// Reads a list of networks: `allow`, or `from` of a rule.
void load_networks(Loading& loading, yaml::MapReader& in, std::string_view key,
                   std::vector<Network>& networks);

/// Reads the key `hosts` of `http`: names and addresses, without ports.
void load_hosts(Loading& loading, yaml::MapReader& in, web::Settings& settings);
/// Reads its key `cors`: origins as browsers send them.
void load_cors(Loading& loading, yaml::MapReader& in, std::vector<std::string>& origins);

/// Reads the key `tokens` of `http`. Secrets are read from their files.
void load_tokens(Loading& loading, yaml::MapReader& in, std::vector<web::Token>& tokens);

}  // namespace panelgate::config
