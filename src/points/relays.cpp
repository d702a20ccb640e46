#include "panelgate/points/relays.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "panelgate/base/who.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::points {

std::string_view label(RelayState state) {
    static constexpr std::array<std::string_view, 4> kLabels{"waiting", "ok", "source failing",
                                                             "target failing"};
    return kLabels.at(static_cast<std::size_t>(state));
}

std::string text_of(const RelayStatus& relay) {
    std::string text(label(relay.state));
    return relay.why.empty() ? text : text + ": " + relay.why;
}

namespace {

constexpr auto kRepairPause = 1s;  ///< between two repairs of one relay

/// True if the write changes the target of this relay, as far as is known.
bool changes_target(const RelayRoute& route, const bus::WriteEvent& write) {
    if (write.station != 0 && write.station != route.to_station) return false;
    if (!write.items) return true;
    const modbus::Span target{route.relay.to.table, route.relay.to.address, route.relay.count};
    if (write.items->overlaps(target)) return true;
    return route.to_memory.changes(*write.items, target).value_or(false);
}

/// True if both copy the same registers between the same panels, at any interval.
bool is_same(const RelayRoute& one, const RelayRoute& other) {
    return one.relay.name() == other.relay.name() && one.relay.count == other.relay.count &&
           one.relay.from == other.relay.from && one.relay.to == other.relay.to &&
           one.relay.on_change == other.relay.on_change && one.from == other.from &&
           one.to == other.to && one.from_station == other.from_station &&
           one.to_station == other.to_station && one.to_has_multiple == other.to_has_multiple;
}

/// Returns why the answer is a failure; empty if it is not.
std::string failure_of(const bus::Answer& answer) {
    if (!answer.pdu) return std::string(label(outcome_of(answer.pdu.error())));
    const auto code = modbus::exception_of(*answer.pdu);
    return code ? "exception " + std::to_string(*code) : std::string();
}

/// Returns the request that writes the values of this reply.
Bytes write_of(const RelayRoute& route, ByteView reply) {
    const std::uint16_t address = route.relay.to.address;
    const bool single = route.relay.count == 1 && !route.to_has_multiple;
    if (modbus::is_bit_table(route.relay.to.table)) {
        const std::vector<bool> bits = modbus::bits_of(reply, route.relay.count);
        return single ? modbus::encode_write_coil(address, bits[0])
                      : modbus::encode_write_coils(address, bits);
    }
    const std::vector<std::uint16_t> words = modbus::registers_of(reply);
    return single ? modbus::encode_write_register(address, words[0])
                  : modbus::encode_write_registers(address, words);
}

}  // namespace

struct Relays::State : std::enable_shared_from_this<Relays::State> {
    struct Entry : std::enable_shared_from_this<Entry> {
        Entry(rt::Clock& clock, RelayRoute r) : route(std::move(r)), alarm(clock.make_alarm()) {
            status.name = route.relay.name();
            who = own_task("relay " + status.name);
        }
        RelayRoute route;
        std::unique_ptr<rt::Alarm> alarm;
        TimePoint due;
        RelayStatus status;
        bus::ClientId client = bus::next_client_id();
        WhoRef who;
        Bytes writing;              ///< the write in progress
        Bytes written;              ///< the last confirmed write
        TimePoint written_turn;     ///< its turn
        std::uint64_t returns = 0;  ///< of the target, at that time
        bool open = false;          ///< a request is outstanding; its answer leads to arm()
        bool overwritten = false;   ///< by another client, not repaired yet
        bool repairing = false;     ///< the next confirmed write is a repair
        TimePoint next_repair{};    ///< earliest time
    };
    explicit State(rt::Clock& c) : clock(c) {}
    using Continuation = void (State::*)(Entry&, const bus::Answer&);

    void arm(Entry& entry);
    void read(Entry& entry);
    void on_read(Entry& entry, const bus::Answer& answer);
    void on_written(Entry& entry, const bus::Answer& answer);
    bool target_is_current(const Entry& entry, const Bytes& write) const;
    void check_target(Entry& entry);
    void on_write(const std::string& line, const bus::WriteEvent& write);
    void apply(std::vector<RelayRoute> routes);
    void begin(Entry& entry, TimePoint due);
    void end(Entry& entry);
    void ask(Entry& entry, bus::BusClient& bus, std::uint8_t station, Bytes pdu, Continuation then);
    void set(Entry& entry, RelayState state, std::string why = {});

    rt::Clock& clock;
    using EntryPtr = std::shared_ptr<Entry>;  ///< shared with outstanding requests
    std::vector<EntryPtr> entries;
    std::set<bus::ClientId> clients;  ///< of the relays
    Changed changed;
    bool running = false;
};

/// Arms the alarm for the next turn in the future (turns missed by a slow panel are lost), or
/// earlier for a repair.
void Relays::State::arm(Entry& entry) {
    const TimePoint now = clock.now();
    const Duration every = entry.route.relay.every;
    while (entry.due <= now) entry.due += every * ((now - entry.due) / every + 1);
    TimePoint at = entry.due;
    if (entry.overwritten) at = std::min(at, std::max(now, entry.next_repair));
    entry.open = false;
    entry.alarm->arm(at, [this, &entry] { read(entry); });
}

void Relays::State::ask(Entry& entry, bus::BusClient& bus, std::uint8_t station, Bytes pdu,
                        Continuation then) {
    auto request = modbus::Request::make(std::move(pdu), modbus::QuantityCheck::wide);
    if (!request) return (this->*then)(entry, bus::Answer{.pdu = request.error()});
    bus.transact(
        {.station = station,
         .request = std::move(*request),
         .client = entry.client,
         .who = entry.who,
         .poll = true},
        [weak = weak_from_this(), kept = entry.weak_from_this(), then](const bus::Answer& answer) {
            const auto self = weak.lock();
            const auto alive = kept.lock();
            if (self && self->running && alive) (self.get()->*then)(*alive, answer);
        });
}

void Relays::State::read(Entry& entry) {
    entry.open = true;
    const TimePoint now = clock.now();
    if (entry.overwritten && now >= entry.next_repair) {
        entry.overwritten = false;
        entry.repairing = true;
        entry.next_repair = now + kRepairPause;
    }
    const Relay& relay = entry.route.relay;
    ask(entry, *entry.route.from, entry.route.from_station,
        modbus::encode_read({relay.from.table, relay.from.address, relay.count}), &State::on_read);
}

void Relays::State::on_read(Entry& entry, const bus::Answer& answer) {
    if (const std::string why = failure_of(answer); !why.empty()) {
        ++entry.status.read_failures;
        set(entry, RelayState::source_failing, why);
        arm(entry);
        return;
    }
    ++entry.status.reads;
    Bytes write = write_of(entry.route, *answer.pdu);
    if (entry.route.relay.on_change && target_is_current(entry, write)) {
        check_target(entry);
        arm(entry);
        return;
    }
    entry.writing = write;
    ask(entry, *entry.route.to, entry.route.to_station, std::move(write), &State::on_written);
}

/// True if the target holds these values, as far as can be known without reading it.
bool Relays::State::target_is_current(const Entry& entry, const Bytes& write) const {
    const RelayRoute& route = entry.route;
    return !entry.repairing && write == entry.written &&
           entry.due - entry.written_turn < route.relay.refresh &&
           route.to->station_status(route.to_station).returns == entry.returns;
}

/// Nothing to write: reports a target that is gone, and writes again when it returns.
void Relays::State::check_target(Entry& entry) {
    const bool line_up = entry.route.to->status().up;
    const Health health = entry.route.to->station_status(entry.route.to_station).state;
    if (line_up && health != Health::offline) return set(entry, RelayState::ok);
    entry.written.clear();
    set(entry, RelayState::target_failing,
        std::string(label(line_up ? Outcome::offline : Outcome::line_down)));
}

void Relays::State::on_written(Entry& entry, const bus::Answer& answer) {
    if (const std::string why = failure_of(answer); !why.empty()) {
        entry.written.clear();  // the target's content is unknown: write again
        ++entry.status.write_failures;
        set(entry, RelayState::target_failing, why);
    } else {
        ++entry.status.writes;
        entry.status.last_write = clock.now();
        if (std::exchange(entry.repairing, false)) ++entry.status.repairs;
        entry.written = std::move(entry.writing);
        entry.written_turn = entry.due;
        entry.returns = entry.route.to->station_status(entry.route.to_station).returns;
        set(entry, RelayState::ok);
    }
    arm(entry);
}

/// Called from inside the bus: makes no requests.
void Relays::State::on_write(const std::string& line, const bus::WriteEvent& write) {
    if (write.ended) return;
    for (const auto& entry : entries) {
        if (entry->route.to_line != line) continue;
        if (write.client == entry->client) {  // overwrites what was written before
            if (std::exchange(entry->overwritten, false)) entry->repairing = true;
            continue;
        }
        // Relays may write to the same line as configured: their targets do not overlap.
        if (clients.contains(write.client) || !changes_target(entry->route, write)) continue;
        entry->overwritten = true;
        if (!entry->open) arm(*entry);
    }
}

void Relays::State::set(Entry& entry, RelayState state, std::string why) {
    if (entry.status.state == state && entry.status.why == why) return;
    entry.status.state = state;
    entry.status.why = std::move(why);
    if (changed) changed(entry.status);
}

/// Entries of unchanged relays continue and do not write again.
void Relays::State::apply(std::vector<RelayRoute> routes) {
    std::vector<EntryPtr> before = std::exchange(entries, {});
    clients.clear();
    for (RelayRoute& route : routes) {
        const auto found = std::ranges::find_if(
            before, [&](const EntryPtr& entry) { return entry && is_same(entry->route, route); });
        if (found != before.end()) {
            entries.push_back(std::move(*found));
            const bool interval_changed = entries.back()->route.relay.every != route.relay.every;
            entries.back()->route = std::move(route);
            if (interval_changed && running && !entries.back()->open) {
                entries.back()->due = clock.now();
                arm(*entries.back());
            }
        } else {
            entries.push_back(std::make_shared<Entry>(clock, std::move(route)));
            if (running) begin(*entries.back(), clock.now());
        }
        clients.insert(entries.back()->client);
    }
    for (const EntryPtr& gone : before) {
        if (gone && running) end(*gone);
    }
}

void Relays::State::begin(Entry& entry, TimePoint due) {
    entry.due = due;
    for (bus::BusClient* bus : {entry.route.from, entry.route.to})
        bus->name_client(entry.client, entry.who->name);
    arm(entry);
}

void Relays::State::end(Entry& entry) {
    entry.alarm->cancel();
    entry.route.from->cancel(entry.client);
    entry.route.to->cancel(entry.client);
}

Relays::Relays(rt::Clock& clock, std::vector<RelayRoute> routes)
    : state_(std::make_shared<State>(clock)) {
    state_->apply(std::move(routes));
}

Relays::~Relays() { stop(); }

void Relays::apply(std::vector<RelayRoute> routes) { state_->apply(std::move(routes)); }

void Relays::on_state(Changed changed) { state_->changed = std::move(changed); }

void Relays::start() {
    state_->running = true;
    const TimePoint now = state_->clock.now();
    const auto count = static_cast<Duration::rep>(state_->entries.size());
    Duration::rep index = 0;
    for (const auto& entry : state_->entries)
        state_->begin(*entry, now + entry->route.relay.every * index++ / count);  // spread
}

void Relays::stop() {
    if (!std::exchange(state_->running, false)) return;
    for (const auto& entry : state_->entries) state_->end(*entry);
}

std::vector<RelayStatus> Relays::status() const {
    std::vector<RelayStatus> all;
    for (const auto& entry : state_->entries) all.push_back(entry->status);
    return all;
}

std::function<void(const std::string&, const bus::WriteEvent&)> Relays::write_listener() const {
    return [weak = std::weak_ptr(state_)](const std::string& line, const bus::WriteEvent& write) {
        const auto state = weak.lock();
        if (state && state->running) state->on_write(line, write);
    };
}

}  // namespace panelgate::points
