#pragma once

#include <functional>
#include <optional>
#include <string>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// What a variable of the environment is set to; nothing when it is not set.
using Environment = std::function<std::optional<std::string>(const std::string& name)>;

/// Puts variables into every value (keys stay as they are): `${NAME}`, and `${NAME:-default}` for
/// one that is unset or empty. `$$` is a dollar; any other dollar stands for itself. A variable
/// that is not set and has no default is a problem at the value that names it; so is a form that is
/// neither. Marks, and what was in quotes, stay; Node::variable says which it was. No environment:
/// nothing is set.
void expand_variables(Node& tree, const Environment& environment, Problems& problems);

/// Puts what a map takes over from others in the place of its merge key: `<<: *a`, or
/// `<<: [*a, *b]`. Its own keys win, then those of the map that is named first; nothing is merged
/// below them. What was taken over keeps its marks. (yaml.org/type/merge.html)
void resolve_merge_keys(Node& tree, Problems& problems);

}  // namespace panelgate::yaml
