#include "running_line.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <variant>

#include "panelgate/bus/listening_bus.hpp"
#include "panelgate/line/tcp_line.hpp"
#include "panelgate/line/tty_line.hpp"
#include "plant.hpp"
#include "simulated_line.hpp"
#include "wiring.hpp"

namespace panelgate::app {
namespace {

bool is_simulated(const config::Line& line, bool simulate) {
    return simulate || line.kind == config::Line::Kind::simulated;
}

bool is_remote(const config::Line& line, bool simulate) {
    return line.kind == config::Line::Kind::tcp && !simulate;
}

/// The panels that are played.
bool plays_alike(const config::Line& before, const config::Line& now) {
    return before.simulated_echo == now.simulated_echo &&
           std::ranges::equal(before.stations, now.stations,
                              [](const config::Station& one, const config::Station& other) {
                                  return one.id == other.id && one.profile == other.profile &&
                                         one.faults == other.faults;
                              });
}

constexpr std::size_t kWires = 64;

}  // namespace

std::string wire_of(const config::Line& line) {
    if (line.kind != config::Line::Kind::serial) return line.device.device;
    std::error_code unknown;
    const auto path = std::filesystem::weakly_canonical(line.device.device, unknown);
    return unknown ? line.device.device : path.string();
}

bool is_same_wire(const config::Line& before, const config::Line& now, bool simulate) {
    return before.kind == now.kind && before.device == now.device &&
           before.listens == now.listens && arbiter::is_same_wire(before.arbiter, now.arbiter) &&
           (!is_simulated(now, simulate) || plays_alike(before, now));
}

RunningLine::RunningLine(boost::asio::any_io_executor executor, rt::Clock& clock,
                         const config::Line& line, bool simulate, LineWatch watch)
    : executor_(std::move(executor)),
      clock_(clock),
      simulate_(simulate),
      listens_(line.listens),
      watch_(std::move(watch)) {
    auto wire = make_wire(line);
    bus::Settings settings = settings_of(line);
    if (listens_) {
        bus_ = std::make_unique<bus::ListeningBus>(executor_, clock_, std::move(settings),
                                                   std::move(wire));
    } else {
        bus_ = std::make_unique<bus::Bus>(executor_, clock_, std::move(settings), std::move(wire));
    }
    apply_points(line);
}

bus::Settings RunningLine::settings_of(const config::Line& line) {
    bus::Settings settings = bus_settings(line);
    if (simulated_) settings.device = kSimulatedDevice;
    settings.arbiter.may_stall = is_remote(line, simulate_);
    settings.observe = [this, name = line.name](const bus::BusEvent& event) {
        on_event(name, event);
    };
    return settings;
}

/// And the panels at its other end, where they are simulated.
std::unique_ptr<line::Line> RunningLine::make_wire(const config::Line& line) {
    line::Settings device = line.device;
    if (wires_.size() >= kWires) wires_.clear();  // those before are long clear
    if (!is_simulated(line, simulate_)) wires_.insert(wire_of(line));
    simulated_.reset();
    if (is_simulated(line, simulate_)) {
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
    if (simulated_) simulated_->start();
    bus_->start();
    if (poller_) poller_->start();
}

void RunningLine::stop() {
    running_ = false;
    if (poller_) poller_->stop();
    bus_->stop();
    if (simulated_) simulated_->stop();
}

void RunningLine::dispose() {
    poller_.reset();
    bus_.reset();
    simulated_.reset();
}

/// What is polled changes behind the bus: nothing is asked for in the old way then.
void RunningLine::apply(const config::Line& before, const config::Line& now) {
    if (running_ && is_same_wire(before, now, simulate_)) {
        bus_->apply(settings_of(now), nullptr, nullptr);
    } else {
        std::shared_ptr<sim::SimulatedBus> far_end = simulated_;
        auto wire = make_wire(now);
        if (simulated_) simulated_->start();
        bus_->apply(settings_of(now), std::move(wire), std::move(far_end));
        if (wire_of(before) != wire_of(now)) forget_points();
    }
    apply_points(now);
    if (!std::exchange(running_, true) && poller_) poller_->start();
}

/// They were those of other panels.
void RunningLine::forget_points() {
    if (poller_) poller_->apply({});
    heard_.clear();
}

/// One poller a line. What it reads answers clients too, where a station's max_age allows it.
void RunningLine::apply_points(const config::Line& line) {
    std::vector<points::PolledStation> wanted = polled_stations(line);
    if (listens_) {
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
    if (listens_) {
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
    const auto* write = std::get_if<bus::WriteEvent>(&event);
    if (write != nullptr && write_listener_) write_listener_(*write);
    watch_.event(line, event);
}

/// A broadcast is to all of them.
void RunningLine::hear(const std::string& line, const tap::Transaction& heard) {
    for (const auto& [station, values] : heard_) {
        if (heard.station != 0 && heard.station != station) continue;
        const auto wants = values->on_heard(heard);
        if (!wants.empty()) watch_.points(line, station, wants);
    }
}

}  // namespace panelgate::app
