#include "panelgate/points/relays.hpp"

#include <utility>

#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::points {

namespace {

/// Why an answer is none; empty when it is one.
std::string failure_of(const bus::Answer& answer) {
    if (!answer.pdu) return std::string(label(outcome_of(answer.pdu.error())));
    const auto code = modbus::exception_of(*answer.pdu);
    return code ? "exception " + std::to_string(*code) : std::string();
}

/// The request that writes what this reply holds.
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
    struct Entry {
        Entry(rt::Clock& clock, RelayRoute r) : route(std::move(r)), alarm(clock.make_alarm()) {
            status.name = route.relay.name();
        }
        RelayRoute route;
        std::unique_ptr<rt::Alarm> alarm;
        TimePoint due;
        RelayStatus status;
        bus::ClientId client = bus::next_client_id();
        Bytes written;              ///< the last write that was confirmed
        TimePoint written_for;      ///< the turn that it was of
        std::uint64_t returns = 0;  ///< of the target, then
    };
    explicit State(rt::Clock& c) : clock(c) {}
    using Then = void (State::*)(Entry&, const bus::Answer&);

    void arm(Entry& entry);
    void read(Entry& entry);
    void on_read(Entry& entry, const bus::Answer& answer);
    void on_written(Entry& entry, const bus::Answer& answer);
    bool holds(const Entry& entry, const Bytes& write) const;
    void check_target(Entry& entry);
    void ask(Entry& entry, bus::BusClient& bus, std::uint8_t station, Bytes pdu, Then then);
    void set(Entry& entry, RelayState state, std::string why = {});

    rt::Clock& clock;
    std::vector<std::unique_ptr<Entry>> entries;
    Changed changed;
    bool running = false;
};

/// The next turn that is still to come: what a slow panel has missed is missed.
void Relays::State::arm(Entry& entry) {
    const TimePoint now = clock.now();
    const Duration every = entry.route.relay.every;
    while (entry.due <= now) entry.due += every * ((now - entry.due) / every + 1);
    entry.alarm->arm(entry.due, [this, &entry] { read(entry); });
}

void Relays::State::ask(Entry& entry, bus::BusClient& bus, std::uint8_t station, Bytes pdu,
                        Then then) {
    auto request = modbus::Request::make(std::move(pdu), modbus::QuantityCheck::wide);
    if (!request) return (this->*then)(entry, bus::Answer{.pdu = request.error()});
    bus.transact(
        {.station = station, .request = std::move(*request), .client = entry.client, .poll = true},
        [weak = weak_from_this(), &entry, then](const bus::Answer& answer) {
            const auto self = weak.lock();
            if (self && self->running) (self.get()->*then)(entry, answer);
        });
}

void Relays::State::read(Entry& entry) {
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
    if (entry.route.relay.on_change && holds(entry, write)) {
        check_target(entry);
        arm(entry);
        return;
    }
    entry.written = write;
    ask(entry, *entry.route.to, entry.route.to_station, std::move(write), &State::on_written);
}

/// The target has this, as far as anybody can know without asking it.
bool Relays::State::holds(const Entry& entry, const Bytes& write) const {
    const RelayRoute& route = entry.route;
    return write == entry.written && entry.due - entry.written_for < route.relay.refresh &&
           route.to->station_status(route.to_station).returns == entry.returns;
}

/// Nothing has to be written; but a target that has gone may come back with something else.
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
        entry.written.clear();  // whatever the target holds now: it is written again
        ++entry.status.write_failures;
        set(entry, RelayState::target_failing, why);
    } else {
        ++entry.status.writes;
        entry.status.last_write = clock.now();
        entry.written_for = entry.due;
        entry.returns = entry.route.to->station_status(entry.route.to_station).returns;
        set(entry, RelayState::ok);
    }
    arm(entry);
}

void Relays::State::set(Entry& entry, RelayState state, std::string why) {
    if (entry.status.state == state && entry.status.why == why) return;
    entry.status.state = state;
    entry.status.why = std::move(why);
    if (changed) changed(entry.status);
}

Relays::Relays(rt::Clock& clock, std::vector<RelayRoute> routes)
    : state_(std::make_shared<State>(clock)) {
    for (RelayRoute& route : routes)
        state_->entries.push_back(std::make_unique<State::Entry>(clock, std::move(route)));
}

Relays::~Relays() { stop(); }

void Relays::on_state(Changed changed) { state_->changed = std::move(changed); }

void Relays::start() {
    state_->running = true;
    const TimePoint now = state_->clock.now();
    const auto count = static_cast<Duration::rep>(state_->entries.size());
    Duration::rep index = 0;
    for (const auto& entry : state_->entries) {
        entry->due = now + entry->route.relay.every * index++ / count;  // spread
        for (bus::BusClient* bus : {entry->route.from, entry->route.to})
            bus->name_client(entry->client, "relay " + entry->status.name);
        state_->arm(*entry);
    }
}

void Relays::stop() {
    if (!std::exchange(state_->running, false)) return;
    for (const auto& entry : state_->entries) {
        entry->alarm->cancel();
        entry->route.from->cancel(entry->client);
        entry->route.to->cancel(entry->client);
    }
}

std::vector<RelayStatus> Relays::status() const {
    std::vector<RelayStatus> all;
    for (const auto& entry : state_->entries) all.push_back(entry->status);
    return all;
}

}  // namespace panelgate::points
