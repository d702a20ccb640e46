#pragma once

#include "loader.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::config {

/// Reports every key and value with a line end or another control character, from an escape
/// ("\\u0007") or a variable: names and labels go into logs, metrics and pages, and no
/// configuration needs one.
void refuse_control_characters(const yaml::Node& tree, yaml::Problems& problems);

/// Warns about listeners in what was loaded from `tree` without a problem: writable from outside
/// (is_reachable_from_outside()), sharing a port, units that hide the stations with these ids,
/// tokens that others can read or guess, UDP open to the outside, and what anonymous clients from
/// there may see.
void warn_of_listeners(Loading& loading, const yaml::Node& tree);

}  // namespace panelgate::config
