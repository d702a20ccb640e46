#pragma once

#include <boost/json/object.hpp>
#include <string>

#include "panelgate/config/config.hpp"

namespace panelgate::explain {

/// Describes all of a configuration, so that a user notices what is missing: what each entry is in
/// words, who may what, and all that is set and not what leaving it out means.
std::string inventory_text(const config::Config& config);
/// All settings but secrets, as in the file: maps, lists, and keys, of which a time is KEY_ms. What
/// is not set is left out. Lines have `polls` and `clients` besides, and lines and masters say in
/// `serial` what `serial_format` has.
boost::json::object inventory_json(const config::Config& config);

}  // namespace panelgate::explain
