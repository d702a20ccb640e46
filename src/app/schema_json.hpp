#pragma once

#include <boost/json/object.hpp>

namespace panelgate::app {

/// A JSON Schema (2020-12) of the configuration, made of what the loader asks for
/// (config::describe()). Whatever the loader takes is valid; of what it refuses, unknown keys and
/// values of the wrong kind are not.
boost::json::object schema_json();

}  // namespace panelgate::app
