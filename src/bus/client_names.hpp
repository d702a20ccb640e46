#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// Null: a client without a name.
using ClientName = std::shared_ptr<const std::string>;

/// Names of clients for messages. Bounded; a client that has gone is forgotten. Pure.
class ClientNames {
  public:
    static constexpr std::size_t kClients = 8192;

    /// Replaces an earlier name.
    void set(ClientId client, std::string name) {
        const auto known = names_.find(client);
        if (known == names_.end() && names_.size() >= kClients) return;
        names_.insert_or_assign(client, std::make_shared<const std::string>(std::move(name)));
    }
    void forget(ClientId client) { names_.erase(client); }
    /// Returns a name that stays valid after the client has gone.
    ClientName name(ClientId client) const {
        const auto known = names_.find(client);
        return known == names_.end() ? nullptr : known->second;
    }
    std::string of(ClientId client) const { return words(name(client)); }
    static std::string words(const ClientName& name) {
        return name ? *name : "a client without a name";
    }

  private:
    std::map<ClientId, ClientName> names_;
};

/// The arbiter's reasons and decisions in words, one line each; "" for a frame that has no reason.
/// `client`: the name of who has asked.
std::string text_of(const arbiter::Reason& reason, const ClientName& client);
std::string text_of(const arbiter::Decision& decision, const ClientName& client,
                    const arbiter::QueueSettings& queue);

}  // namespace panelgate::bus
