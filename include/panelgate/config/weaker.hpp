#pragma once

#include <string>
#include <vector>

#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// Lists where `next` protects less than `running`, one line each ("station press: access read_only
/// -> read_write"): who may write, who may connect and from where, what a guard refuses, roles and
/// tokens, what the gateway writes by itself (repeated writes, relays), and what the audit keeps.
/// Empty if nowhere. Doubtful cases are listed: two networks that together cover a third do not
/// count as covering it. Pure.
std::vector<std::string> weaker(const Config& running, const Config& next);

}  // namespace panelgate::config
