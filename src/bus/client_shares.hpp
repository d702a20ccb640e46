#pragma once

#include <map>
#include <string>
#include <vector>

#include "panelgate/arbiter/bus_shares.hpp"
#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

using ClientNames = std::map<ClientId, std::string>;
/// "client 12" when nobody named it.
std::string name_of(const ClientNames& names, ClientId client);

/// The greediest clients with their names.
std::vector<ClientShare> client_shares(const arbiter::BusShares& shares, const ClientNames& names);

}  // namespace panelgate::bus
