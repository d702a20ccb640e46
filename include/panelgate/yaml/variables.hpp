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

}  // namespace panelgate::yaml
