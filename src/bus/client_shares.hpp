#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client_accounts.hpp"
#include "panelgate/arbiter/bus_shares.hpp"
#include "panelgate/arbiter/client_names.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// The greediest clients with their names.
std::vector<ClientShare> client_shares(const arbiter::BusShares& shares,
                                       const arbiter::ClientNames& names,
                                       const ClientAccounts& accounts, TimePoint now);

/// Of a client's name: a server's clients are called by its word and where they come from
/// ("modbus_tcp 10.0.0.7:51234", "http ::1 token ops"). Nothing for others.
std::optional<std::string> address_in(const std::string& name);

}  // namespace panelgate::bus
