#pragma once

#include <vector>

#include "client_accounts.hpp"
#include "departed_clients.hpp"
#include "panelgate/arbiter/bus_shares.hpp"
#include "panelgate/arbiter/client_names.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// Where it stands what clients have used of a line.
struct ClientUse {
    const arbiter::BusShares& shares;
    const arbiter::ClientNames& names;
    const ClientAccounts& accounts;
    DepartedClients& departed;
    Duration busy{};  ///< of the line, whoever has used it
};

/// The greediest clients with their names, a name once, and what is not theirs as the last.
std::vector<ClientShare> client_shares(const ClientUse& use, TimePoint now);

}  // namespace panelgate::bus
