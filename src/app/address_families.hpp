#pragma once

#include "panelgate/config/config.hpp"

namespace panelgate::app {

/// A listener on "[::]:502" serves IPv4 as well, unless another one has that port on an address of
/// IPv4: then each has its own kind.
void separate_families(config::Config& config);

}  // namespace panelgate::app
