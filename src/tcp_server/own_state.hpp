#pragma once

#include "diagnostics.hpp"
#include "shared.hpp"

namespace panelgate::tcp_server {

/// What the gateway tells of itself now. `shared` outlives it.
Diagnostics own_state(const Shared& shared);

}  // namespace panelgate::tcp_server
