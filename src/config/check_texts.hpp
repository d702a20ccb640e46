#pragma once

#include "panelgate/yaml/document.hpp"

namespace panelgate::config {

/// A problem at every key and value that holds a line end or another control character, by an
/// escape ("\\u0007") or out of a variable: names and labels go into logs, metrics and pages, and
/// nothing of a configuration needs one.
void refuse_control_characters(const yaml::Node& tree, yaml::Problems& problems);

}  // namespace panelgate::config
