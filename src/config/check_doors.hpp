#pragma once

#include "loader.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::config {

/// A problem at every key and value that holds a line end or another control character, by an
/// escape ("\\u0007") or out of a variable: names and labels go into logs, metrics and pages, and
/// nothing of a configuration needs one.
void refuse_control_characters(const yaml::Node& tree, yaml::Problems& problems);

/// Warns of doors that stand open, or that somebody else stands behind, in what was loaded from
/// `tree` without a problem: listeners on all addresses through which anybody may write, listeners
/// that take each other's port, units that are not the stations that have these ids, and tokens
/// that others can read or guess, datagrams for all, what all may see.
void warn_of_doors(Loading& loading, const yaml::Node& tree);

}  // namespace panelgate::config
