#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

#include "panelgate/base/outcome.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// How many requests each client has made, and how they ended. Bounded; a client that has gone is
/// forgotten, and what is then still answered counts for nobody. Pure.
class ClientAccounts {
  public:
    static constexpr std::size_t kClients = 1024;

    struct Account {
        std::uint64_t requests = 0;
        std::uint64_t failed = 0;
        std::optional<Outcome> last_error{};
        TimePoint failed_at{};
    };

    void asked(ClientId client) {
        if (client == 0) return;  // nobody's
        if (!accounts_.contains(client) && accounts_.size() >= kClients) return;
        ++accounts_[client].requests;
    }
    void answered(ClientId client, Outcome outcome, TimePoint now) {
        const auto known = accounts_.find(client);
        const bool is_good =
            outcome == Outcome::ok || outcome == Outcome::cached || outcome == Outcome::shared;
        if (is_good || known == accounts_.end()) return;
        ++known->second.failed;
        known->second.last_error = outcome;
        known->second.failed_at = now;
    }
    void forget(ClientId client) { accounts_.erase(client); }
    /// Nothing asked yet: all zero.
    Account of(ClientId client) const {
        const auto known = accounts_.find(client);
        return known == accounts_.end() ? Account{} : known->second;
    }
    const std::map<ClientId, Account>& all() const { return accounts_; }

  private:
    std::map<ClientId, Account> accounts_;
};

}  // namespace panelgate::bus
