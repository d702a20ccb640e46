#pragma once

#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// For whose sake every broadcast through this listener is refused (01): a read-only station that
/// it would reach. Nullptr: nobody's, or there are none.
const Station* forbids_broadcasts(const Config& config, const tcp_server::Settings& listener);

}  // namespace panelgate::config
