#pragma once

#include <boost/json/object.hpp>
#include <string>

#include "panelgate/config/config.hpp"

namespace panelgate::app {

/// All that a configuration holds, so that whoever checks it sees what got lost: lines, stations,
/// their points and polls, relays, unit ids, who may read and write, and where it listens.
std::string inventory_text(const config::Config& config);
/// The same as members: lines (with their stations and polls), relays, modbus_tcp, http.
boost::json::object inventory_json(const config::Config& config);

}  // namespace panelgate::app
