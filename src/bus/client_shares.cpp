#include "client_shares.hpp"

#include <algorithm>

namespace panelgate::bus {

std::vector<ClientShare> client_shares(const arbiter::BusShares& shares,
                                       const arbiter::ClientNames& names) {
    constexpr std::size_t kShown = 100;
    Duration all{};
    std::vector<ClientShare> list;
    for (const auto& [client, share] : shares.all()) {
        ClientShare entry;
        entry.name = names.of(client);
        entry.busy = share.busy;
        entry.transactions = share.transactions;
        all += share.busy;
        list.push_back(std::move(entry));
    }
    std::ranges::sort(list, std::ranges::greater{}, &ClientShare::busy);
    for (ClientShare& entry : list) {
        entry.percent = all > Duration::zero() ? 100 * to_seconds(entry.busy) / to_seconds(all) : 0;
    }
    if (list.size() > kShown) list.resize(kShown);
    return list;
}

}  // namespace panelgate::bus
