#pragma once

#include "loader.hpp"

namespace panelgate::config {

/// The keys of a listener that say how its clients speak: `framing`, `udp`, `ascii_lower_case`,
/// `broadcast` and `retransmissions`.
void load_framing(yaml::MapReader& in, tcp_server::Settings& settings);

}  // namespace panelgate::config
