#include "panelgate/points/poller.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "panelgate/base/who.hpp"

namespace panelgate::points {

struct Poller::State : std::enable_shared_from_this<Poller::State> {
    struct Station {
        std::uint8_t id = 0;
        std::string name;
        bus::ClientId client =
            bus::next_client_id();  ///< one client each, so that stations take turns
        WhoRef who;
        PlanLimits limits;
        std::shared_ptr<StationPolls> polls;
    };
    using StationPtr = std::shared_ptr<Station>;  ///< shared with outstanding requests

    State(rt::Clock& c, bus::RequestPort& b) : clock(c), bus(b), alarm(c.make_alarm()) {}

    void send_due();
    StationPtr make(PolledStation wanted) const;
    void apply(std::vector<PolledStation> wanted);
    void set_client_name(Station& station);
    void ask(const StationPtr& station, StationPolls::Due due);
    void on_answer(Station& station, std::size_t read, const bus::Answer& answer, TimePoint asked);
    void on_write(const bus::WriteEvent& write);
    void arm();

    rt::Clock& clock;
    bus::RequestPort& bus;
    std::unique_ptr<rt::Alarm> alarm;
    std::vector<StationPtr> stations;
    Update update;
    bool running = false;
};

void Poller::State::send_due() {
    const TimePoint now = clock.now();
    for (const StationPtr& station : stations) {
        if (auto due = station->polls->take_due(now)) ask(station, std::move(*due));
    }
    arm();
}

void Poller::State::ask(const StationPtr& station, StationPolls::Due due) {
    bus::Request request{.station = station->id,
                         .request = std::move(due.request),
                         .client = station->client,
                         .who = station->who,
                         .poll = true};
    bus.transact(std::move(request),
                 [weak = weak_from_this(), of = std::weak_ptr(station), read = due.read,
                  asked = clock.now()](const bus::Answer& answer) {
                     const auto self = weak.lock();
                     const auto alive = of.lock();  // null if the station was removed or replaced
                     if (self && alive) self->on_answer(*alive, read, answer, asked);
                 });
}

void Poller::State::on_answer(Station& station, std::size_t read, const bus::Answer& answer,
                              TimePoint asked) {
    // The time of asking is the safe choice: the value is not older than that.
    const auto wants = station.polls->on_answer(clock.now(), read, answer.pdu, asked);
    if (!running) return;  // told when the poller was stopped
    if (update && !wants.empty()) update(station.id, wants);
    arm();
}

Poller::State::StationPtr Poller::State::make(PolledStation wanted) const {
    auto made = std::make_shared<Station>();
    made->id = wanted.id;
    made->name = std::move(wanted.name);
    made->limits = wanted.limits;
    made->polls = std::make_shared<StationPolls>(std::move(wanted.wants), std::move(wanted.limits),
                                                 clock.now(), std::move(wanted.memory));
    return made;
}

void Poller::State::set_client_name(Station& station) {
    const std::string called =
        station.name.empty() ? "station " + std::to_string(station.id) : station.name;
    station.who = own_task("poll of " + called);
    bus.name_client(station.client, station.who->name);
}

void Poller::State::apply(std::vector<PolledStation> wanted) {
    const std::vector<StationPtr> before = std::exchange(stations, {});
    for (PolledStation& one : wanted) {
        const auto found = std::ranges::find(before, one.id, &Station::id);
        const bool known = found != before.end();
        if (known && (*found)->polls->wants() == one.wants && (*found)->limits == one.limits) {
            (*found)->polls->apply(std::move(one.memory));
            (*found)->name = std::move(one.name);
            if (running) set_client_name(**found);
            stations.push_back(*found);
            continue;
        }
        stations.push_back(make(std::move(one)));
        if (known) stations.back()->polls->adopt(*(*found)->polls);
        if (running) set_client_name(*stations.back());
    }
    for (const StationPtr& old : before) {
        if (running && std::ranges::find(stations, old) == stations.end()) bus.cancel(old->client);
    }
    if (running) arm();
}

/// Called from inside the bus: makes no requests.
void Poller::State::on_write(const bus::WriteEvent& write) {
    const TimePoint now = clock.now();
    for (const StationPtr& station : stations) {
        if (write.station != 0 && write.station != station->id) continue;
        if (write.ended) {
            station->polls->on_written(now, write.items);
            continue;
        }
        const auto wants = station->polls->on_write(now, write.items);
        if (update && !wants.empty()) update(station->id, wants);
    }
    if (write.ended) arm();
}

void Poller::State::arm() {
    std::optional<TimePoint> next;
    for (const StationPtr& station : stations) {
        const auto due = station->polls->next_due();
        if (due && (!next || *due < *next)) next = due;
    }
    if (next) {
        alarm->arm(*next, [this] { send_due(); });
    } else {
        alarm->cancel();
    }
}

Poller::Poller(rt::Clock& clock, bus::RequestPort& bus, std::vector<PolledStation> stations)
    : state_(std::make_shared<State>(clock, bus)) {
    state_->apply(std::move(stations));
}

Poller::~Poller() { stop(); }

void Poller::apply(std::vector<PolledStation> stations) { state_->apply(std::move(stations)); }

void Poller::on_update(Update update) { state_->update = std::move(update); }

std::function<void(const bus::WriteEvent&)> Poller::write_listener() const {
    return [weak = std::weak_ptr(state_)](const bus::WriteEvent& write) {
        const auto state = weak.lock();
        if (state && state->running) state->on_write(write);
    };
}

void Poller::start() {
    state_->running = true;
    for (const State::StationPtr& station : state_->stations) state_->set_client_name(*station);
    state_->arm();
}

void Poller::stop() {
    if (!std::exchange(state_->running, false)) return;
    state_->alarm->cancel();
    for (const State::StationPtr& station : state_->stations) state_->bus.cancel(station->client);
}

std::shared_ptr<const StationPolls> Poller::find(std::uint8_t station) const {
    const auto found = std::ranges::find(state_->stations, station, &State::Station::id);
    return found == state_->stations.end() ? nullptr : (*found)->polls;
}

}  // namespace panelgate::points
