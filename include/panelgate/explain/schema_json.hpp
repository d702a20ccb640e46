#pragma once

#include <boost/json/object.hpp>

namespace panelgate::explain {

/// A JSON Schema (2020-12) of the configuration, made from the loader's description
/// (config::describe()). Whatever the loader accepts is valid; of what it rejects, unknown keys and
/// values of the wrong kind are invalid.
boost::json::object schema_json();

}  // namespace panelgate::explain
