#pragma once

#include <string>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::explain {

/// Warns of what `check` can know of access and audit, and a start would not refuse: rules that
/// nobody can come by, tokens that have ended, an audit without its folder.
std::vector<std::string> access_doubts(const config::Config& config, WallTime now);

}  // namespace panelgate::explain
