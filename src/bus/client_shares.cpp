#include "client_shares.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

namespace panelgate::bus {
namespace {

using Rows = std::map<std::string, ClientShare>;
using Account = ClientAccounts::Account;

void add(ClientShare& entry, const Account& account, TimePoint now) {
    entry.requests += account.requests;
    entry.failed += account.failed;
    if (!account.last_error) return;
    const Duration ago = now - account.failed_at;
    if (entry.last_error && entry.last_error_ago < ago) return;
    entry.last_error = account.last_error;
    entry.last_error_ago = ago;
}

void add(ClientShare& entry, const arbiter::BusShares::Share& share) {
    entry.busy += share.busy;
    entry.transactions += share.transactions;
}

Rows rows_of(const ClientUse& use, TimePoint now) {
    Rows rows;
    for (const auto& [client, account] : use.accounts.all())
        add(rows[use.names.of(client)], account, now);
    for (const auto& [client, share] : use.shares.all()) add(rows[use.names.of(client)], share);
    for (const auto& [name, row] : use.departed.rows(now)) {
        const bool is_there = rows.contains(name);
        ClientShare& entry = rows[name];
        if (!is_there) entry.gone = now - row.left;
        add(entry, row.asked, now);
        add(entry, row.used);
    }
    return rows;
}

Duration busy_of(const std::vector<ClientShare>& list) {
    Duration sum{};
    for (const ClientShare& entry : list) sum += entry.busy;
    return sum;
}

/// Those who are not shown for themselves; what is still missing is the gateway's own.
ClientShare others(const ClientUse& use, TimePoint now) {
    ClientShare rest;
    rest.name = kOtherClients;
    add(rest, use.departed.forgotten().asked, now);
    add(rest, use.departed.forgotten().used);
    return rest;
}

/// The last of a long list are no rows of their own.
void shorten(std::vector<ClientShare>& list, ClientShare& rest) {
    constexpr std::size_t kShown = 100;
    for (std::size_t i = kShown; i < list.size(); ++i) {
        rest.busy += list[i].busy;
        rest.transactions += list[i].transactions;
        rest.requests += list[i].requests;
        rest.failed += list[i].failed;
    }
    if (list.size() > kShown) list.resize(kShown);
}

}  // namespace

std::vector<ClientShare> client_shares(const ClientUse& use, TimePoint now) {
    constexpr Duration kSeen = 1ms;  // below, it is what dividing leaves
    std::vector<ClientShare> list;
    for (auto& [name, entry] : rows_of(use, now)) {
        entry.name = name;
        entry.address = address_in(name);
        list.push_back(std::move(entry));
    }
    std::ranges::sort(list, std::ranges::greater{}, &ClientShare::busy);
    ClientShare rest = others(use, now);
    shorten(list, rest);
    const Duration shown = busy_of(list);
    rest.busy = std::max(rest.busy, use.busy - shown);
    const Duration all = shown + rest.busy;
    if (rest.busy >= kSeen || rest.requests > 0) list.push_back(std::move(rest));
    for (ClientShare& entry : list)
        entry.percent = all > Duration::zero() ? 100 * to_seconds(entry.busy) / to_seconds(all) : 0;
    return list;
}

}  // namespace panelgate::bus
