#pragma once

#include <functional>
#include <optional>
#include <string>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// Returns the value of an environment variable; nothing if it is not set.
using Environment = std::function<std::optional<std::string>(const std::string& name)>;

/// Expands variables in every value (not in keys): `${NAME}`, and `${NAME:-default}` if unset or
/// empty. `$$` is a dollar; any other dollar stays. An unset variable without a default is a
/// problem at its value; so is any other form of `${`. Marks and quoting stay; Node::variable has
/// the name. Without an environment no variable is set.
void expand_variables(Node& tree, const Environment& environment, Problems& problems);

/// Replaces merge keys by what they take over: `<<: *a`, or `<<: [*a, *b]`. The map's own keys win,
/// then those of the map named first; nested maps are not merged. Merged keys keep their marks.
/// (yaml.org/type/merge.html)
void resolve_merge_keys(Node& tree, Problems& problems);

}  // namespace panelgate::yaml
