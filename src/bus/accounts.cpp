#include "accounts.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/network.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::bus {

ClientId next_client_id() {
    static std::atomic<ClientId> last{0};
    return ++last;
}

void log_event(const Settings& settings, const arbiter::StationEvent& event) {
    const std::string station = name_of(settings.stations, event.station);
    const std::string ms = std::to_string(std::lround(std::ceil(to_milliseconds(event.by))));
    const auto say = [&](rt::LogLevel level, const char* what, const std::string& hint) {
        if (hint.empty()) {
            rt::log(level, what, {{"line", settings.name}, {"station", station}});
        } else {
            rt::log(level, what, {{"line", settings.name}, {"station", station}, {"hint", hint}});
        }
    };
    switch (event.kind) {
        case arbiter::StationEvent::Kind::offline:
            return say(rt::LogLevel::warn, "station offline", "");
        case arbiter::StationEvent::Kind::online:
            return say(rt::LogLevel::info, "station online", "");
        case arbiter::StationEvent::Kind::suspect:
        case arbiter::StationEvent::Kind::heard:
        case arbiter::StationEvent::Kind::unknown:
            return;
        case arbiter::StationEvent::Kind::late:
            // Behind an adaptive timeout the settings are not at fault.
            if (event.by <= Duration::zero()) return say(rt::LogLevel::info, "late reply", "");
            return say(rt::LogLevel::warn, "late reply",
                       "raise its response_timeout by at least " + ms + "ms");
        case arbiter::StationEvent::Kind::drift:
            return say(rt::LogLevel::warn, "station has become slow",
                       "it takes up to " + ms + "ms, near its response_timeout; raise that");
        case arbiter::StationEvent::Kind::collision:
            return say(rt::LogLevel::warn, "collision",
                       "the echo is not what was sent: is there another master, or no echo?");
        case arbiter::StationEvent::Kind::echo:
            return say(
                settings.arbiter.echo == EchoMode::off ? rt::LogLevel::warn : rt::LogLevel::info,
                "line hears itself", "its echo is checked and taken out");
        case arbiter::StationEvent::Kind::trail:
            return say(rt::LogLevel::warn, "bytes behind its replies",
                       "the line now waits up to " + ms +
                           "ms for them; look at how its transceiver lets go of the line");
    }
}

namespace {

/// Format of the `raw` request.
std::string hex_of(ByteView pdu) {
    std::string hex = to_hex(pdu);
    std::erase(hex, ' ');
    return hex;
}

/// Shortens a request that had no effect: the log may get many such requests.
std::string shortened(const std::string& hex) {
    constexpr std::size_t kShown = 64;
    return hex.size() > kShown ? hex.substr(0, kShown) + "..." : hex;
}

/// False for reads, 0 and exception codes (128 and above), which are not functions.
bool may_write(ByteView pdu) { return !modbus::is_pure_read(pdu) && pdu[0] != 0 && pdu[0] < 0x80; }

/// The write was transmitted or executed: a panel may have changed.
bool is_accepted(const WriteEnd& write) {
    return write.transaction != 0 || write.outcome == Outcome::ok;
}

std::string place_of(const std::optional<modbus::Span>& written) {
    if (!written) return "";
    return std::string(modbus::label(written->table)) + '/' + std::to_string(written->first);
}

}  // namespace

std::optional<WriteEnd> write_record_of(const Request& request) {
    const modbus::Request& asked = request.request;
    if (!may_write(asked.pdu())) return std::nullopt;
    return WriteEnd{request.who, asked.pdu(), asked.access().write, !request.poll};
}

std::optional<WriteEnd> write_record_of(ByteView pdu, const WhoRef& who) {
    if (!may_write(pdu)) return std::nullopt;
    WriteEnd write{who, Bytes(pdu.begin(), pdu.end())};
    if (modbus::check_request(pdu, modbus::QuantityCheck::wide))
        write.items = modbus::access_of(pdu).write;
    return write;
}

bool may_tell(const Settings& settings, const WhoRef& who, std::uint8_t station) {
    if (!settings.access) return true;
    return station == 0 ? settings.access->may_read_some(who)
                        : settings.access->may_some(who, station, access::Act::read);
}

std::map<std::string, std::uint64_t> denials_by_rule(
    const Settings& settings, const std::map<std::string, std::uint64_t>& counted) {
    std::map<std::string, std::uint64_t> all;
    if (!settings.access) return all;
    auto next = all.end();  // most names follow the one before: no search
    for (std::string& rule : settings.access->denying_names()) {
        const auto count = counted.find(rule);
        next = all.emplace_hint(next, std::move(rule), count == counted.end() ? 0 : count->second);
        ++next;
    }
    return all;
}

std::optional<Refusal> unrecordable(const Settings& settings, std::uint8_t station) {
    if (!settings.refuses_writes || !settings.refuses_writes()) return std::nullopt;
    return unrecorded(name_of(settings.stations, station));
}

void complete(WriteEnd& write, const Answer& answer) {
    write.transmitted = answer.transmitted;
    write.transaction = answer.transactions.last();
    if (answer.pdu && !answer.refusal) write.exception = modbus::exception_of(*answer.pdu);
    if (!answer.refusal) return;
    write.denied = answer.refusal->rule == Rule::denied;
    write.rule = write.denied ? answer.refusal->why : std::string(label(answer.refusal->rule));
}

void log_write(const Settings& settings, const WriteEnd& write) {
    const std::string name =
        write.station == 0 ? std::string("broadcast") : name_of(settings.stations, write.station);
    const std::string full_name = text_of(write.who);
    const std::string certificate = write.who ? write.who->certificate : "";
    const std::string client = name_of_host(full_name) + ' ' + certificate;
    const std::string at = place_of(write.items);
    const std::string pdu = hex_of(write.pdu);
    const std::string place = settings.name + '/' + name + ' ' + at;
    const std::string ended(label(write.outcome));
    const bool accepted = is_accepted(write);
    std::vector<rt::LogField> fields{
        {"line", settings.name}, {"station", name}, {"client", full_name}};
    if (!certificate.empty()) fields.push_back({"certificate", certificate});
    if (!at.empty()) fields.push_back({"at", at});
    fields.push_back({"pdu", accepted ? pdu : shortened(pdu)});
    fields.push_back({"outcome", ended});
    const std::string transaction = std::to_string(write.transaction);
    if (write.transaction != 0) fields.push_back({"transaction", transaction});
    if (write.denied) fields.push_back({"rule", write.rule});
    if (!accepted) return rt::log_collapsed("write", place + ' ' + client, fields);
    rt::log_each("write", place, client + ' ' + pdu + ' ' + ended, fields);
}

namespace {

void add(DepartedClients::Row& sum, const DepartedClients::Row& more) {
    sum.used.busy += more.used.busy;
    sum.used.transactions += more.used.transactions;
    sum.totals.requests += more.totals.requests;
    sum.totals.failed += more.totals.failed;
    sum.left = std::max(sum.left, more.left);
    if (!more.totals.last_error || more.totals.failed_at < sum.totals.failed_at) return;
    sum.totals.last_error = more.totals.last_error;
    sum.totals.failed_at = more.totals.failed_at;
}

}  // namespace

void DepartedClients::leave(TimePoint now, const std::string& name,
                            const arbiter::BusShares::Share& used,
                            const ClientAccounts::Totals& totals) {
    const Row row{used, totals, now};
    drop_old(now);
    // Internal tasks end when the configuration changes: they are not remembered.
    if (address_in(name).empty() || settings_.remembered == 0) return add(forgotten_, row);
    const std::string key = name_of_host(name);
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

namespace {

using Rows = std::map<std::string, ClientShare>;

void add(ClientShare& entry, const ClientAccounts::Totals& totals, TimePoint now) {
    entry.requests += totals.requests;
    entry.failed += totals.failed;
    if (!totals.last_error) return;
    const Duration ago = now - totals.failed_at;
    if (entry.last_error && entry.last_error_ago < ago) return;
    entry.last_error = totals.last_error;
    entry.last_error_ago = ago;
}

void add(ClientShare& entry, const arbiter::BusShares::Share& share) {
    entry.busy += share.busy;
    entry.transactions += share.transactions;
}

Rows rows_of(const ClientUse& use, TimePoint now) {
    Rows rows;
    for (const auto& [client, totals] : use.accounts.all())
        add(rows[use.names.of(client)], totals, now);
    for (const auto& [client, share] : use.shares.all()) add(rows[use.names.of(client)], share);
    for (const auto& [name, row] : use.departed.rows(now)) {
        const bool is_connected = rows.contains(name);
        ClientShare& entry = rows[name];
        if (!is_connected) entry.gone = now - row.left;
        add(entry, row.totals, now);
        add(entry, row.used);
    }
    return rows;
}

Duration busy_of(const std::vector<ClientShare>& list) {
    Duration sum{};
    for (const ClientShare& entry : list) sum += entry.busy;
    return sum;
}

/// Clients without a row of their own. The gateway's own time is added by client_shares().
ClientShare other_clients(const ClientUse& use, TimePoint now) {
    ClientShare rest;
    rest.name = kOtherClients;
    add(rest, use.departed.forgotten().totals, now);
    add(rest, use.departed.forgotten().used);
    return rest;
}

/// Adds the rows beyond the limit to `rest` and drops them.
void fold_tail(std::vector<ClientShare>& list, ClientShare& rest) {
    constexpr std::size_t kShown = 100;
    for (std::size_t i = kShown; i < list.size(); ++i) {
        rest.busy += list[i].busy;
        rest.transactions += list[i].transactions;
        rest.requests += list[i].requests;
        rest.failed += list[i].failed;
    }
    if (list.size() > kShown) list.resize(kShown);
}

}  // namespace

std::vector<ClientShare> client_shares(const ClientUse& use, TimePoint now) {
    constexpr Duration kRoundingLimit = 1ms;  // less is a rounding error of divided shares
    std::vector<ClientShare> list;
    for (auto& [name, entry] : rows_of(use, now)) {
        entry.name = name;
        if (const auto address = address_in(name); !address.empty()) entry.address = address;
        list.push_back(std::move(entry));
    }
    std::ranges::sort(list, std::ranges::greater{}, &ClientShare::busy);
    ClientShare rest = other_clients(use, now);
    fold_tail(list, rest);
    const Duration shown = busy_of(list);
    rest.busy = std::max(rest.busy, use.busy - shown);
    const Duration all = shown + rest.busy;
    if (rest.busy >= kRoundingLimit || rest.requests > 0) list.push_back(std::move(rest));
    for (ClientShare& entry : list)
        entry.percent = all > Duration::zero() ? 100 * to_seconds(entry.busy) / to_seconds(all) : 0;
    return list;
}

namespace {

std::optional<bool> is_up(Health state) {
    if (state == Health::unknown) return {};
    return state == Health::online || state == Health::heard || state == Health::suspect;
}

}  // namespace

Outcome outcome_of(const Answer& answer) {
    if (!answer.pdu) return outcome_of(answer.pdu.error());
    if (modbus::exception_of(*answer.pdu))
        return answer.transmitted ? Outcome::exception : Outcome::refused;
    if (answer.source == Source::cache) return Outcome::cached;
    return answer.shared ? Outcome::shared : Outcome::ok;
}

RequestCounters::RequestCounters(const Stations& stations) { apply(stations); }

void RequestCounters::apply(const Stations& stations) {
    std::map<std::uint8_t, StationReport> before = std::exchange(stations_, {});
    stations_[0] = std::move(before[0]);
    stations_[0].station = kOtherStations;
    for (const auto& [id, station] : stations) {
        stations_[id] = std::move(before[id]);
        stations_[id].station = station.name;
        stations_[id].configured = true;
        for (const std::uint8_t function : station.functions) stations_[id].requests[function];
        for (const auto& functions : station.translations) stations_[id].translated[functions];
    }
}

StationReport& RequestCounters::of(std::uint8_t station) {
    const auto found = stations_.find(station);
    return found == stations_.end() ? stations_[0] : found->second;
}

void RequestCounters::count(std::uint8_t station, std::uint8_t function, Outcome outcome,
                            Duration took) {
    StationReport& report = of(station);
    ++report.requests[modbus::is_known(function) ? function : kOtherFunctions][outcome];
    report.request_duration.observe(took);
}

void RequestCounters::succeeded(std::uint8_t station, double wall) {
    of(station).last_success_unix = wall;
}

OutcomeCounts RequestCounters::outcomes(std::uint8_t station) const {
    OutcomeCounts all;
    const auto found = stations_.find(station);
    if (found == stations_.end() || !found->second.configured) return all;
    for (const auto& [function, counts] : found->second.requests) {
        for (const Outcome outcome : kAllOutcomes) all[outcome] += counts[outcome];
    }
    return all;
}

std::vector<StationReport> RequestCounters::report(const Machine& arbiter) const {
    // A station that has never been heard is not up, and not yet known to be down.
    return report(arbiter.station_counters(), [&](std::uint8_t id) -> State {
        const arbiter::StationHealth& health = arbiter.health(id);
        const bool is_open = health.state() == Health::suspect && !health.last_heard();
        return {is_open ? Health::unknown : health.state(), arbiter.condition(id)};
    });
}

std::vector<StationReport> RequestCounters::report(
    const std::map<std::uint8_t, arbiter::StationCounters>& wire_counters,
    const std::function<State(std::uint8_t)>& state) const {
    std::vector<StationReport> reports;
    for (const auto& [id, counted] : stations_) {
        StationReport report = counted;
        const auto wire = wire_counters.find(id);
        if (wire != wire_counters.end()) report.wire = wire->second;
        const State now = state(id);
        report.up = is_up(now.health);
        if (report.up) report.condition = now.condition;
        reports.push_back(std::move(report));
    }
    return reports;
}

void observe(const Settings& settings, const BusEvent& event) {
    if (settings.observe) settings.observe(event);
}

Account::Account(const Settings& settings) : settings_(settings), counters_(settings.stations) {}

void Account::add(std::uint8_t station, std::uint8_t function, std::optional<WriteEnd> write,
                  Outcome outcome, Duration took) {
    counters_.count(station, function, outcome, took);
    if (write) end_write(station, *write, outcome);
    observe(settings_, TransactionEvent{station, function, outcome, took});
}

void Account::end_write(std::uint8_t station, WriteEnd& write, Outcome outcome) {
    write.station = station;
    write.outcome = outcome;
    if (write.logged) log_write(settings_, write);
    if (settings_.record_write) settings_.record_write(write);
}

void Account::add_refused(std::uint8_t station, ByteView pdu, const WhoRef& who, std::string rule) {
    if (pdu.empty()) return;
    auto write = write_record_of(pdu, who);
    if (write) write->rule = std::move(rule);
    add(station, pdu[0], std::move(write), Outcome::refused, Duration::zero());
}

}  // namespace panelgate::bus
