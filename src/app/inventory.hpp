#pragma once

#include <boost/json/object.hpp>
#include <string>

#include "panelgate/config/config.hpp"

namespace panelgate::app {

/// Describes all of a configuration, so that a user notices what is missing: lines, stations, their
/// points and polls, relays, unit ids, access rights and listeners.
std::string inventory_text(const config::Config& config);
/// The same as JSON: lines (with their stations and polls), relays, modbus_tcp, http.
boost::json::object inventory_json(const config::Config& config);

}  // namespace panelgate::app
