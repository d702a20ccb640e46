#include "client_shares.hpp"

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <boost/system/error_code.hpp>
#include <map>
#include <string_view>
#include <utility>

namespace panelgate::bus {
namespace {

using Shares = std::map<ClientId, ClientShare>;

void add(Shares& all, const ClientAccounts& accounts, TimePoint now) {
    for (const auto& [client, account] : accounts.all()) {
        ClientShare& entry = all[client];
        entry.requests = account.requests;
        entry.failed = account.failed;
        entry.last_error = account.last_error;
        if (account.last_error) entry.last_error_ago = now - account.failed_at;
    }
}

/// Without a port, and without the brackets that hold one off.
std::string_view host_in(std::string_view word) {
    if (word.starts_with('[')) return word.substr(1, word.find(']') - 1);
    const auto colon = word.find(':');
    const bool has_port = colon != word.npos && word.find(':', colon + 1) == word.npos;
    return has_port ? word.substr(0, colon) : word;
}

}  // namespace

std::optional<std::string> address_in(const std::string& name) {
    const auto blank = name.find(' ');
    if (blank == name.npos) return std::nullopt;
    const std::string_view rest = std::string_view(name).substr(blank + 1);
    const std::string host(host_in(rest.substr(0, rest.find(' '))));
    boost::system::error_code wrong;
    boost::asio::ip::make_address(host, wrong);
    return wrong ? std::nullopt : std::optional(host);
}

std::vector<ClientShare> client_shares(const arbiter::BusShares& shares,
                                       const arbiter::ClientNames& names,
                                       const ClientAccounts& accounts, TimePoint now) {
    constexpr std::size_t kShown = 100;
    Duration all{};
    Shares by_client;
    add(by_client, accounts, now);
    for (const auto& [client, share] : shares.all()) {
        by_client[client].busy = share.busy;
        by_client[client].transactions = share.transactions;
        all += share.busy;
    }
    std::vector<ClientShare> list;
    for (auto& [client, entry] : by_client) {
        entry.name = names.of(client);
        entry.address = address_in(entry.name);
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
