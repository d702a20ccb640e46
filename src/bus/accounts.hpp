#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client_names.hpp"
#include "machine.hpp"
#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/counters.hpp"
#include "panelgate/bus/rights.hpp"

namespace panelgate::bus {

/// Logs a station event in one line, with a hint.
void log_event(const Settings& settings, const arbiter::StationEvent& event);

/// What is known of a write before it ends; nullopt for reads.
std::optional<WriteEnd> write_record_of(const Request& request);
/// The same for a PDU that was never submitted; without `items` if it is not a valid request.
std::optional<WriteEnd> write_record_of(ByteView pdu, const WhoRef& who);
/// True if the rules let `who` read something of this station (0: of the line).
bool may_tell(const Settings& settings, const WhoRef& who, std::uint8_t station);
/// Counts by the name of the rule: all that may refuse, and no others.
std::map<std::string, std::uint64_t> denials_by_rule(
    const Settings& settings, const std::map<std::string, std::uint64_t>& counted);
/// Refuses a write while none can be recorded.
std::optional<Refusal> unrecordable(const Settings& settings, std::uint8_t station);
/// Completes the record of a write that has ended.
void complete(WriteEnd& write, const Answer& answer);
/// Logs at info, without the gateway's own. Every transmitted write is logged with its whole PDU
/// (rt::log_each); writes that were refused or abandoned before are rate-limited.
void log_write(const Settings& settings, const WriteEnd& write);

/// Counts each client's requests and their outcomes. Bounded; later answers to a forgotten client
/// are not counted. Pure.
class ClientAccounts {
  public:
    static constexpr std::size_t kClients = 1024;

    struct Totals {
        std::uint64_t requests = 0;
        std::uint64_t failed = 0;
        std::optional<Outcome> last_error{};
        TimePoint failed_at{};
    };

    void count_request(ClientId client) {
        if (client == 0) return;  // no client
        if (!accounts_.contains(client) && accounts_.size() >= kClients) return;
        ++accounts_[client].requests;
    }
    void count_outcome(ClientId client, Outcome outcome, TimePoint now) {
        const auto known = accounts_.find(client);
        const bool is_good =
            outcome == Outcome::ok || outcome == Outcome::cached || outcome == Outcome::shared;
        if (is_good || known == accounts_.end()) return;
        ++known->second.failed;
        known->second.last_error = outcome;
        known->second.failed_at = now;
    }
    void forget(ClientId client) { accounts_.erase(client); }
    /// Returns zeros for an unknown client.
    Totals of(ClientId client) const {
        const auto known = accounts_.find(client);
        return known == accounts_.end() ? Totals{} : known->second;
    }
    const std::map<ClientId, Totals>& all() const { return accounts_; }

  private:
    std::map<ClientId, Totals> accounts_;
};

/// Line use by disconnected clients. A script that connects once per request counts as one client.
/// Keeps only servers' clients, by name_of_host(), within the settings' time and number. Pure.
class DepartedClients {
  public:
    struct Row {
        arbiter::BusShares::Share used;
        ClientAccounts::Totals totals;
        TimePoint left;
    };

    explicit DepartedClients(ClientSettings settings = {}) : settings_(settings) {}
    void apply(ClientSettings settings) { settings_ = settings; }

    /// `name`: the client's full name while connected.
    void leave(TimePoint now, const std::string& name, const arbiter::BusShares::Share& used,
               const ClientAccounts::Totals& totals);
    /// Returns the remembered clients by name.
    const std::map<std::string, Row>& rows(TimePoint now);
    /// Returns the sum of all others.
    const Row& forgotten() const { return forgotten_; }

  private:
    void drop_old(TimePoint now);
    void make_room();

    ClientSettings settings_;
    std::map<std::string, Row> rows_;
    Row forgotten_{};
};

/// The sources of client_shares().
struct ClientUse {
    const arbiter::BusShares& shares;
    const ClientNames& names;
    const ClientAccounts& accounts;
    DepartedClients& departed;
    Duration busy{};  ///< the line's total
};

/// Returns the clients with the largest shares by name, merged per name, and last a row for the
/// rest.
std::vector<ClientShare> client_shares(const ClientUse& use, TimePoint now);

Outcome outcome_of(const Answer& answer);

/// Counts requests by station, function and outcome. Unlisted stations share one entry, unknown
/// functions one label: no client can add a series (P10).
class RequestCounters {
  public:
    explicit RequestCounters(const Stations& stations);
    /// Drops the counters of stations no longer listed.
    void apply(const Stations& stations);

    void count(std::uint8_t station, std::uint8_t function, Outcome outcome, Duration took);
    /// Counts a request that was sent as function `sent`.
    void translated(std::uint8_t station, std::uint8_t function, std::uint8_t sent) {
        ++of(station).translated[{function, sent}];
    }
    void succeeded(std::uint8_t station, double wall);
    /// Returns the sum over all functions; zeros for an unlisted station.
    OutcomeCounts outcomes(std::uint8_t station) const;
    /// Returns the reports, joined with the arbiter's counters.
    std::vector<StationReport> report(const Machine& arbiter) const;
    /// A station's health, and its condition on a line where stations are asked.
    struct State {
        Health health = Health::unknown;
        std::optional<Condition> condition{};
    };
    /// The same with counters and states from listening.
    std::vector<StationReport> report(const std::map<std::uint8_t, arbiter::StationCounters>& wire,
                                      const std::function<State(std::uint8_t)>& state) const;

  private:
    StationReport& of(std::uint8_t station);

    std::map<std::uint8_t, StationReport> stations_;  ///< 0: unlisted stations and broadcasts
};

/// Calls the observer, if there is one.
void observe(const Settings& settings, const BusEvent& event);

/// Records the end of each request, on driven and on listening lines: in the metrics, in the write
/// log, and for the observer. `settings` outlives it.
class Account {
  public:
    explicit Account(const Settings& settings);
    /// Call after the settings changed.
    void apply() { counters_.apply(settings_.stations); }

    void add(std::uint8_t station, std::uint8_t function, std::optional<WriteEnd> write,
             Outcome outcome, Duration took);
    /// Counts a request that a server refused before submitting it, by a rule of `access` if it is
    /// named. An empty PDU is ignored.
    void add_refused(std::uint8_t station, ByteView pdu, const WhoRef& who, std::string rule = {});

    RequestCounters& counters() { return counters_; }
    const RequestCounters& counters() const { return counters_; }

  private:
    void end_write(std::uint8_t station, WriteEnd& write, Outcome outcome);

    const Settings& settings_;
    RequestCounters counters_;
};

}  // namespace panelgate::bus
