#pragma once

#include <vector>

#include "loader.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::config {

/// Gives every station that names a `template` what that says and the station does not: its own
/// keys win, maps are put together key by key (as a station's `timing` with its line's), lists are
/// the station's or the template's. `templates` and `template` are gone from the tree then. What
/// comes from a template keeps its marks. Returns the bodies that no station names, each with a
/// warning.
std::vector<yaml::Node> apply_templates(Loading& loading, yaml::Node& tree);

}  // namespace panelgate::config
