#pragma once

#include <boost/json/object.hpp>
#include <string>

#include "panelgate/config/config.hpp"

namespace panelgate::explain {

/// Describes a whole configuration in words, so that a user notices missing parts: each entry, the
/// rights of each role, and all settings that differ from the default.
std::string inventory_text(const config::Config& config);
/// All settings but secrets, as in the file: maps, lists, and keys, of which a time is KEY_ms. What
/// is not set is left out. Lines have `polls` and `clients` besides, and lines and masters say in
/// `serial` what `serial_format` has.
boost::json::object inventory_json(const config::Config& config);

}  // namespace panelgate::explain
