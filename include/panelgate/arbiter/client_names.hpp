#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "panelgate/arbiter/job.hpp"

namespace panelgate::arbiter {

/// Nothing: a client without a name.
using ClientName = std::shared_ptr<const std::string>;

/// What clients are called in words for people: the one place that knows. Bounded; a client that
/// has gone is forgotten. Pure.
class ClientNames {
  public:
    static constexpr std::size_t kClients = 8192;

    /// The last name counts.
    void set(Client client, std::string name) {
        const auto known = names_.find(client);
        if (known == names_.end() && names_.size() >= kClients) return;
        names_.insert_or_assign(client, std::make_shared<const std::string>(std::move(name)));
    }
    void forget(Client client) { names_.erase(client); }
    /// For later, when it may have gone.
    ClientName name(Client client) const {
        const auto known = names_.find(client);
        return known == names_.end() ? nullptr : known->second;
    }
    std::string of(Client client) const { return words(name(client)); }
    static std::string words(const ClientName& name) {
        return name ? *name : "a client without a name";
    }

  private:
    std::map<Client, ClientName> names_;
};

}  // namespace panelgate::arbiter
