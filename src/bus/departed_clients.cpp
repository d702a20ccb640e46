#include "departed_clients.hpp"

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <boost/system/error_code.hpp>
#include <iterator>
#include <string_view>

namespace panelgate::bus {
namespace {

/// Without a port, and without the brackets that hold one off.
std::string_view host_in(std::string_view word) {
    if (word.starts_with('[')) return word.substr(1, word.find(']') - 1);
    const auto colon = word.find(':');
    const bool has_port = colon != word.npos && word.find(':', colon + 1) == word.npos;
    return has_port ? word.substr(0, colon) : word;
}

void add(DepartedClients::Row& sum, const DepartedClients::Row& more) {
    sum.used.busy += more.used.busy;
    sum.used.transactions += more.used.transactions;
    sum.asked.requests += more.asked.requests;
    sum.asked.failed += more.asked.failed;
    sum.left = std::max(sum.left, more.left);
    if (!more.asked.last_error || more.asked.failed_at < sum.asked.failed_at) return;
    sum.asked.last_error = more.asked.last_error;
    sum.asked.failed_at = more.asked.failed_at;
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

std::string without_port(const std::string& name) {
    const auto address = address_in(name);
    if (!address) return name;
    const auto begin = name.find(' ') + 1;
    const auto end = std::min(name.find(' ', begin), name.size());
    return name.substr(0, begin) + *address + name.substr(end);
}

void DepartedClients::leave(TimePoint now, const std::string& name,
                            const arbiter::BusShares::Share& used,
                            const ClientAccounts::Account& asked) {
    const Row row{used, asked, now};
    drop_old(now);
    // The gateway's own tasks end when the configuration changes.
    if (!address_in(name) || settings_.remembered == 0) return add(forgotten_, row);
    const std::string key = without_port(name);
    if (!rows_.contains(key)) make_room();
    add(rows_[key], row);
}

const std::map<std::string, DepartedClients::Row>& DepartedClients::rows(TimePoint now) {
    drop_old(now);
    return rows_;
}

void DepartedClients::drop_old(TimePoint now) {
    for (auto row = rows_.begin(); row != rows_.end();) {
        const bool old = now - row->second.left > settings_.remembered_for;
        if (old) add(forgotten_, row->second);
        row = old ? rows_.erase(row) : std::next(row);
    }
}

void DepartedClients::make_room() {
    while (rows_.size() >= settings_.remembered) {
        const auto first = std::ranges::min_element(
            rows_, {}, [](const auto& entry) { return entry.second.left; });
        add(forgotten_, first->second);
        rows_.erase(first);
    }
}

}  // namespace panelgate::bus
