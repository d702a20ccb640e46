#pragma once

#include "loader.hpp"

namespace panelgate::config {

/// The key `hosts` of `http`: names and addresses, without ports.
void load_hosts(Loading& loading, yaml::MapReader& in, web::Settings& settings);

}  // namespace panelgate::config
