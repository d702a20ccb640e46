#pragma once

#include <vector>

#include "panelgate/arbiter/bus_shares.hpp"
#include "panelgate/arbiter/client_names.hpp"
#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// The greediest clients with their names.
std::vector<ClientShare> client_shares(const arbiter::BusShares& shares,
                                       const arbiter::ClientNames& names);

}  // namespace panelgate::bus
