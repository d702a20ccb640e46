#include "panelgate/gateway/running_line.hpp"

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "panelgate/bus/listening_bus.hpp"
#include "panelgate/gateway/plant.hpp"
#include "panelgate/line/tcp_line.hpp"
#include "panelgate/line/tty_line.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/judge.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/sim/misbehaviour.hpp"
#include "panelgate/sim/station.hpp"

namespace panelgate::gateway {

points::RelayRoute route_of(const Plant& plant, const points::Relay& relay) {
    const Station& from = *plant.find(relay.from.station);
    const Station& to = *plant.find(relay.to.station);
    points::RelayRoute route;
    route.relay = relay;
    route.from = from.bus;
    route.from_station = from.id;
    route.to = to.bus;
    route.to_station = to.id;
    route.to_line = to.line;
    route.to_memory = explain::memory_of(to.configured->profile);
    route.to_has_multiple = explain::takes_multiple(*to.configured->profile, relay.to.table);
    return route;
}

namespace {

struct Played {
    std::vector<profile::ProfileRef> panels;  ///< referenced by the bus's stations
    std::unique_ptr<sim::SimulatedBus> bus;
};

}  // namespace

std::shared_ptr<sim::SimulatedBus> simulate_line(boost::asio::any_io_executor executor,
                                                 rt::Clock& clock, const config::Line& line) {
    auto played = std::make_shared<Played>();
    std::vector<sim::Station> stations;
    for (const config::Station& station : line.stations) {
        stations.emplace_back(*station.profile, station.id);
        played->panels.push_back(station.profile);
    }
    sim::Settings settings;
    settings.serial = line.device.serial;
    settings.echo = line.simulated_echo;
    settings.crc_orders = arbiter::crc_orders(line.arbiter);
    for (const config::Station& station : line.stations)
        settings.faults[station.id] = station.faults;
    played->bus = std::make_unique<sim::SimulatedBus>(std::move(executor), clock, settings,
                                                      std::move(stations));
    sim::SimulatedBus* bus = played->bus.get();
    rt::log(rt::LogLevel::info, "simulating", {{"line", line.name}, {"device", bus->device()}});
    return {std::move(played), bus};
}

std::shared_ptr<const web::SimulatedPanel> simulated_panel(
    const std::shared_ptr<sim::SimulatedBus>& bus, std::uint8_t station) {
    if (bus == nullptr || !bus->has(station)) return nullptr;
    web::SimulatedPanel panel;
    panel.faults = [bus, station] { return sim::to_numbers(bus->faults(station)); };
    panel.set_faults = [bus, station](const sim::FaultNumbers& numbers) {
        sim::Misbehaviour faults;
        auto wrong = sim::from_numbers(numbers, faults);
        if (!wrong) bus->set_faults(station, faults);
        return wrong;
    };
    return std::make_shared<const web::SimulatedPanel>(std::move(panel));
}

namespace {

bool is_remote(const config::Line& line, bool simulate) {
    return line.kind == config::Line::Kind::tcp && !simulate;
}

constexpr std::size_t kWires = 64;

}  // namespace

Way way_of(const config::Line& line, bool simulate) {
    if (line.listens) return Way::listens;
    return line.device.modbus_tcp && !simulate ? Way::ethernet : Way::wire;
}

RunningLine::RunningLine(boost::asio::any_io_executor executor, rt::Clock& clock,
                         const config::Line& line, bool simulate, LineWatch watch)
    : executor_(std::move(executor)),
      clock_(clock),
      simulate_(simulate),
      way_(way_of(line, simulate)),
      watch_(std::move(watch)) {
    auto wire = make_wire(line);
    bus::Settings settings = settings_of(line);
    if (way_ == Way::listens) {
        bus_ = std::make_unique<bus::ListeningBus>(executor_, clock_, std::move(settings),
                                                   std::move(wire));
    } else {
        bus_ = std::make_unique<bus::Bus>(executor_, clock_, std::move(settings), std::move(wire));
    }
    apply_points(line);
    apply_ways(line);
}

/// A line with two devices begins with the first one.
void RunningLine::apply_ways(const config::Line& line) {
    ways_.reset();
    configured_.reset();
    if (line.second.empty() || explain::is_simulated(line, simulate_)) return;
    configured_ = line;
    for (config::Station& station : configured_->stations) {
        station.points.clear();
        station.polls.clear();
    }
    ways_ =
        std::make_unique<SecondWay>(executor_, clock_, [this](bool second) { use_way(second); });
    if (running_) ways_->start(line.device, is_remote(line, simulate_));
}

void RunningLine::use_way(bool second) {
    const config::Line way = second ? by_second(*configured_) : *configured_;
    const std::vector<rt::LogField> fields{{"line", way.name}, {"device", way.device.device}};
    if (second)
        rt::log(rt::LogLevel::warn, "second device", fields);
    else
        rt::log(rt::LogLevel::info, "first device again", fields);
    bus_->apply(settings_of(way), make_wire(way), nullptr);
}

bus::Settings RunningLine::settings_of(const config::Line& line) {
    bus::Settings settings = explain::bus_settings(line);
    if (simulated_) settings.device = kSimulatedDevice;
    settings.arbiter.may_stall = is_remote(line, simulate_) && way_ != Way::ethernet;
    if (way_ != Way::ethernet) settings.arbiter.in_flight = 0;
    settings.observe = [this, name = line.name](const bus::BusEvent& event) {
        on_event(name, event);
    };
    if (watch_.write) {
        settings.record_write = [this, name = line.name](const bus::WriteEnd& end) {
            watch_.write(name, end);
        };
    }
    settings.refuses_writes = watch_.refuses_writes;
    settings.standby = line.standby;
    settings.trace = watch_.trace;
    if (watch_.may_send && way_ == Way::wire)
        settings.may_send = [this, name = line.name] { return watch_.may_send(name); };
    if (watch_.admit) {
        settings.admit = [this, name = line.name](const WhoRef& who, std::uint8_t station) {
            return watch_.admit(who, name, station);
        };
    }
    return settings;
}

/// Opens the line, and its simulated panels if it has any.
std::unique_ptr<line::Line> RunningLine::make_wire(const config::Line& line) {
    line::Settings device = line.device;
    device.owner = "line '" + line.name + '\'';
    if (wires_.size() >= kWires)
        wires_.clear();  // no reply is outstanding on the earlier ones any more
    if (!explain::is_simulated(line, simulate_)) wires_.insert(explain::wire_of(line));
    simulated_.reset();
    if (explain::is_simulated(line, simulate_)) {
        simulated_ = simulate_line(executor_, clock_, line);
        device.device = simulated_->device();
        device.rs485 = {};
        device.simulated = true;
    }
    return is_remote(line, simulate_) ? line::make_tcp_line(executor_, clock_, std::move(device))
                                      : line::make_tty_line(executor_, clock_, std::move(device));
}

void RunningLine::start() {
    running_ = true;
    if (ways_) ways_->start(configured_->device, is_remote(*configured_, simulate_));
    if (simulated_) simulated_->start();
    bus_->start();
    if (poller_) poller_->start();
}

void RunningLine::stop() {
    running_ = false;
    if (ways_) ways_->stop();
    if (poller_) poller_->stop();
    bus_->stop();
    if (simulated_) simulated_->stop();
    simulated_.reset();
    minute_ = {};
}

bus::MinuteUse RunningLine::record_minute() {
    const bus::LineReport report = bus_->report();
    const std::vector<bus::ClientShare> clients = bus_->clients();
    minute_.record(clock_.now(), report, clients);
    return minute_.use(clock_.now(), report, clients);
}

bus::MinuteUse RunningLine::last_minute() const {
    return minute_.use(clock_.now(), bus_->report(), bus_->clients());
}

void RunningLine::dispose() {
    ways_.reset();
    poller_.reset();
    bus_.reset();
    simulated_.reset();
}

/// The polls change after the bus, so that nothing is sent with the old settings.
void RunningLine::apply(const config::Line& before, const config::Line& now) {
    if (running_ && explain::is_same_wire(before, now, simulate_)) {
        const bool second = ways_ && ways_->second();
        bus_->apply(settings_of(second ? by_second(now) : now), nullptr, nullptr);
    } else {
        std::shared_ptr<sim::SimulatedBus> far_end = simulated_;
        auto wire = make_wire(now);
        if (simulated_) simulated_->start();
        bus_->apply(settings_of(now), std::move(wire), std::move(far_end));
        if (explain::wire_of(before) != explain::wire_of(now)) forget_points();
        apply_ways(now);
    }
    apply_points(now);
    const bool was_running = std::exchange(running_, true);
    if (ways_ && !was_running) ways_->start(now.device, is_remote(now, simulate_));
    if (!was_running && poller_) poller_->start();
}

/// Drops all values: they were those of other panels.
void RunningLine::forget_points() {
    if (poller_) poller_->apply({});
    heard_.clear();
}

/// A line has one poller. Polled values answer clients as well, as far as a station's max_age
/// allows.
void RunningLine::apply_points(const config::Line& line) {
    std::vector<points::PolledStation> wanted = explain::polled_stations(line);
    if (way_ == Way::listens) {
        const auto before = std::exchange(heard_, {});
        for (points::PolledStation& one : wanted) {
            const auto made =
                std::make_shared<points::HeardValues>(one.wants, std::move(one.memory));
            const auto known = before.find(one.id);
            if (known != before.end()) made->adopt(*known->second);
            heard_.emplace(one.id, made);
        }
        return;
    }
    if (poller_) return poller_->apply(std::move(wanted));
    if (wanted.empty()) return;
    poller_ = std::make_unique<points::Poller>(clock_, *bus_, std::move(wanted));
    poller_->on_update([this, name = line.name](std::uint8_t station, const auto& wants) {
        watch_.points(name, station, wants);
    });
    write_listener_ = poller_->write_listener();
    if (running_) poller_->start();
}

std::optional<points::StationPoints> RunningLine::points_of(const config::Station& station) const {
    if (way_ == Way::listens) {
        const auto found = heard_.find(station.id);
        if (found == heard_.end()) return std::nullopt;
        return points::StationPoints(station.points, station.polls,
                                     std::shared_ptr<const points::HeardValues>(found->second));
    }
    const auto polls = poller_ ? poller_->find(station.id) : nullptr;
    if (!polls) return std::nullopt;
    return points::StationPoints(station.points, station.polls, polls);
}

void RunningLine::on_event(const std::string& line, const bus::BusEvent& event) {
    if (const auto* heard = std::get_if<tap::Transaction>(&event)) hear(line, *heard);
    const auto* state = std::get_if<bus::LineEvent>(&event);
    const bool is_state = state != nullptr && state->station == 0;
    if (is_state && ways_) ways_->on_line(state->up);
    const auto* write = std::get_if<bus::WriteEvent>(&event);
    if (write != nullptr && write_listener_) write_listener_(*write);
    watch_.event(line, event);
}

/// Passes a heard transaction to its station, a broadcast to all stations.
void RunningLine::hear(const std::string& line, const tap::Transaction& heard) {
    for (const auto& [station, values] : heard_) {
        if (heard.station != 0 && heard.station != station) continue;
        const auto wants = values->on_heard(heard);
        if (!wants.empty()) watch_.points(line, station, wants);
    }
}

}  // namespace panelgate::gateway
