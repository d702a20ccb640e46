#pragma once

#include <string>
#include <vector>

#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// In what `next` protects less than `running` does, a line for people each ("station press: access
/// read_only -> read_write"): who may write, who may connect and from where, what a guard refuses,
/// roles and tokens. Empty: in nothing. In doubt it is weaker: two networks that together hold a
/// third are not taken for it. Pure.
std::vector<std::string> weaker(const Config& running, const Config& next);

}  // namespace panelgate::config
