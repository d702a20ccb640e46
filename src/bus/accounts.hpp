#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/arbiter/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/counters.hpp"
#include "panelgate/bus/rights.hpp"
#include "write_log.hpp"

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

/// Where it stands what clients have used of a line.
struct ClientUse {
    const arbiter::BusShares& shares;
    const arbiter::ClientNames& names;
    const ClientAccounts& accounts;
    DepartedClients& departed;
    Duration busy{};  ///< of the line, whoever has used it
};

/// The greediest clients with their names, a name once, and what is not theirs as the last.
std::vector<ClientShare> client_shares(const ClientUse& use, TimePoint now);

Outcome outcome_of(const Answer& answer);

/// Counts requests by station, function and outcome. Stations the configuration does not list share
/// one entry, functions that nobody knows one label: no client can add a series (P10).
class RequestCounters {
  public:
    explicit RequestCounters(const Stations& stations);
    /// What was counted of stations that are no longer listed is forgotten.
    void apply(const Stations& stations);

    void count(std::uint8_t station, std::uint8_t function, Outcome outcome, Duration took);
    /// One that was counted went out as function `sent`.
    void translated(std::uint8_t station, std::uint8_t function, std::uint8_t sent) {
        ++of(station).translated[{function, sent}];
    }
    void succeeded(std::uint8_t station, double wall);
    /// Of all functions; none of a station that is not configured.
    OutcomeCounts outcomes(std::uint8_t station) const;
    /// Joined with what the arbiter counted on the wire.
    std::vector<StationReport> report(const arbiter::Arbiter& arbiter) const;
    /// ... or with what was heard there.
    std::vector<StationReport> report(const std::map<std::uint8_t, arbiter::StationCounters>& wire,
                                      const std::function<Health(std::uint8_t)>& health) const;

  private:
    StationReport& of(std::uint8_t station);

    std::map<std::uint8_t, StationReport> stations_;  ///< 0: the others, and broadcasts
};

/// Whoever watches is told.
void observe(const Settings& settings, const BusEvent& event);

/// Where a request's end goes, on lines that ask and on lines that listen: the metrics, the log of
/// writes, whoever watches. `settings` outlives it.
class Account {
  public:
    explicit Account(const Settings& settings);
    /// Those are others now.
    void apply() { counters_.apply(settings_.stations); }

    void add(std::uint8_t station, std::uint8_t function, const std::optional<Deed>& deed,
             Outcome outcome, Duration took);
    /// A face has refused it before it was a request. An empty PDU is nothing.
    void add_refused(std::uint8_t station, ByteView pdu, ClientId client,
                     const arbiter::ClientNames& names);

    RequestCounters& counters() { return counters_; }
    const RequestCounters& counters() const { return counters_; }

  private:
    const Settings& settings_;
    RequestCounters counters_;
};

}  // namespace panelgate::bus
