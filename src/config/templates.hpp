#pragma once

#include <vector>

#include "loader.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::config {

/// Gives every station that names a `template` the template's keys that it lacks: its own keys win,
/// maps are merged key by key (like a station's `timing` with its line's), lists are not merged.
/// Removes `templates` and `template` from the tree. Values from a template keep their marks.
/// Returns the bodies that no station names, each with a warning.
std::vector<yaml::Node> apply_templates(Loading& loading, yaml::Node& tree);

}  // namespace panelgate::config
