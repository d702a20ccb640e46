#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>

#include "panelgate/arbiter/job.hpp"

namespace panelgate::arbiter {

/// What clients are called in words for people: the one place that knows. Bounded; a client that
/// has gone is forgotten. Pure.
class ClientNames {
  public:
    static constexpr std::size_t kClients = 8192;

    /// The last name counts.
    void set(Client client, std::string name) {
        const auto known = names_.find(client);
        if (known != names_.end()) {
            known->second = std::move(name);
        } else if (names_.size() < kClients) {
            names_.emplace(client, std::move(name));
        }
    }
    void forget(Client client) { names_.erase(client); }
    std::string of(Client client) const {
        const auto known = names_.find(client);
        return known == names_.end() ? "a client without a name" : known->second;
    }

  private:
    std::map<Client, std::string> names_;
};

}  // namespace panelgate::arbiter
