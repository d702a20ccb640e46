#pragma once

#include <map>
#include <optional>
#include <string>

#include "client_accounts.hpp"
#include "panelgate/arbiter/bus_shares.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// What those have used who have hung up: a script has a connection a request, and is one client
/// all the same. Only servers' clients are remembered, by their names without ports, for the time
/// and in the number that the settings allow. Pure.
class DepartedClients {
  public:
    struct Row {
        arbiter::BusShares::Share used;
        ClientAccounts::Account asked;
        TimePoint left;
    };

    explicit DepartedClients(ClientSettings settings = {}) : settings_(settings) {}
    void apply(ClientSettings settings) { settings_ = settings; }

    /// `name` as it was while it was there.
    void leave(TimePoint now, const std::string& name, const arbiter::BusShares::Share& used,
               const ClientAccounts::Account& asked);
    /// Those who are remembered, by name.
    const std::map<std::string, Row>& rows(TimePoint now);
    /// All others together.
    const Row& forgotten() const { return forgotten_; }

  private:
    void drop_old(TimePoint now);
    void make_room();

    ClientSettings settings_;
    std::map<std::string, Row> rows_;
    Row forgotten_{};
};

/// Of a client's name: a server's clients are called by its word and where they come from
/// ("modbus_tcp 10.0.0.7:51234", "http ::1 token ops"). Nothing for others.
std::optional<std::string> address_in(const std::string& name);

/// "modbus_tcp 10.0.0.7" of the first of them; what is no name of a server's client stays.
std::string without_port(const std::string& name);

}  // namespace panelgate::bus
