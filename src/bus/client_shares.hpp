#pragma once

#include <map>
#include <string>
#include <vector>

#include "panelgate/arbiter/bus_shares.hpp"
#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// The greediest clients with their names.
std::vector<ClientShare> client_shares(const arbiter::BusShares& shares,
                                       const std::map<ClientId, std::string>& names);

}  // namespace panelgate::bus
