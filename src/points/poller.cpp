#include "panelgate/points/poller.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace panelgate::points {

struct Poller::State : std::enable_shared_from_this<Poller::State> {
    struct Station {
        std::uint8_t id = 0;
        bus::ClientId client = bus::next_client_id();  ///< of its own: stations take turns
        StationPolls polls;
    };

    State(rt::Clock& c, bus::BusClient& b) : clock(c), bus(b), alarm(c.make_alarm()) {}

    void ask_all();
    void ask(std::size_t index, StationPolls::Due due);
    void on_answer(std::size_t index, std::size_t read, const bus::Answer& answer, TimePoint asked);
    void on_write(const bus::WriteEvent& write);
    void arm();

    rt::Clock& clock;
    bus::BusClient& bus;
    std::unique_ptr<rt::Alarm> alarm;
    std::vector<Station> stations;
    Update update;
    bool running = false;
};

void Poller::State::ask_all() {
    const TimePoint now = clock.now();
    for (std::size_t i = 0; i < stations.size(); ++i) {
        for (StationPolls::Due& due : stations[i].polls.take_due(now)) ask(i, std::move(due));
    }
    arm();
}

void Poller::State::ask(std::size_t index, StationPolls::Due due) {
    bus::Request request{.station = stations[index].id,
                         .request = std::move(due.request),
                         .client = stations[index].client,
                         .poll = true};
    bus.transact(std::move(request), [weak = weak_from_this(), index, read = due.read,
                                      asked = clock.now()](const bus::Answer& answer) {
        const auto self = weak.lock();
        if (self && self->running) self->on_answer(index, read, answer, asked);
    });
}

void Poller::State::on_answer(std::size_t index, std::size_t read, const bus::Answer& answer,
                              TimePoint asked) {
    // Asked is the safe side: the value is at most as old as that.
    const auto wants = stations[index].polls.on_answer(clock.now(), read, answer.pdu, asked);
    if (update && !wants.empty()) update(stations[index].id, wants);
    arm();
}

/// Asks nobody: it is told from inside the bus.
void Poller::State::on_write(const bus::WriteEvent& write) {
    const TimePoint now = clock.now();
    for (Station& station : stations) {
        if (write.station != 0 && write.station != station.id) continue;
        if (write.ended) {
            station.polls.on_written(now, write.items);
            continue;
        }
        const auto wants = station.polls.on_write(now, write.items);
        if (update && !wants.empty()) update(station.id, wants);
    }
    if (write.ended) arm();
}

void Poller::State::arm() {
    std::optional<TimePoint> next;
    for (const Station& station : stations) {
        const auto due = station.polls.next_due();
        if (due && (!next || *due < *next)) next = due;
    }
    if (next) {
        alarm->arm(*next, [this] { ask_all(); });
    } else {
        alarm->cancel();
    }
}

Poller::Poller(rt::Clock& clock, bus::BusClient& bus, std::vector<PolledStation> stations)
    : state_(std::make_shared<State>(clock, bus)) {
    const TimePoint now = clock.now();
    for (PolledStation& station : stations) {
        state_->stations.push_back(
            {station.id, bus::next_client_id(),
             StationPolls(std::move(station.wants), std::move(station.limits), now,
                          std::move(station.memory))});
    }
}

Poller::~Poller() { stop(); }

void Poller::on_update(Update update) { state_->update = std::move(update); }

std::function<void(const bus::WriteEvent&)> Poller::write_listener() const {
    return [weak = std::weak_ptr(state_)](const bus::WriteEvent& write) {
        const auto state = weak.lock();
        if (state && state->running) state->on_write(write);
    };
}

void Poller::start() {
    state_->running = true;
    for (const State::Station& station : state_->stations) {
        state_->bus.name_client(station.client, "poll of station " + std::to_string(station.id));
    }
    state_->arm();
}

void Poller::stop() {
    if (!std::exchange(state_->running, false)) return;
    state_->alarm->cancel();
    for (const State::Station& station : state_->stations) state_->bus.cancel(station.client);
}

const StationPolls* Poller::find(std::uint8_t station) const {
    const auto found = std::ranges::find(state_->stations, station, &State::Station::id);
    return found == state_->stations.end() ? nullptr : &found->polls;
}

}  // namespace panelgate::points
