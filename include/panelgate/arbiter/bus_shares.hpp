#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// How much of the line's time each client has used (P9). A transaction for several is shared out
/// equally. Bounded; a client that has gone is forgotten. Pure.
class BusShares {
  public:
    static constexpr std::size_t kClients = 1024;

    struct Share {
        Duration busy{};
        std::uint64_t transactions = 0;
    };

    void add(Client client, Duration busy) {
        if (!shares_.contains(client) && shares_.size() >= kClients) return;
        shares_[client].busy += busy;
        ++shares_[client].transactions;
    }
    void forget(Client client) { shares_.erase(client); }
    /// Nothing used yet: all zero.
    Share of(Client client) const {
        const auto known = shares_.find(client);
        return known == shares_.end() ? Share{} : known->second;
    }
    const std::map<Client, Share>& all() const { return shares_; }

  private:
    std::map<Client, Share> shares_;
};

}  // namespace panelgate::arbiter
