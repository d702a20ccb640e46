#include "client_shares.hpp"

#include <algorithm>

namespace panelgate::bus {

std::vector<ClientShare> client_shares(const arbiter::BusShares& shares,
                                       const std::map<ClientId, std::string>& names) {
    constexpr std::size_t kShown = 100;
    Duration all{};
    std::vector<ClientShare> list;
    for (const auto& [client, share] : shares.all()) {
        const auto name = names.find(client);
        ClientShare entry;
        entry.name = name == names.end() ? "client " + std::to_string(client) : name->second;
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
