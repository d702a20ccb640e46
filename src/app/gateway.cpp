#include "gateway.hpp"

#include <algorithm>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "panelgate/line/tcp_line.hpp"
#include "panelgate/line/tty_line.hpp"
#include "panelgate/metrics/exposition.hpp"
#include "panelgate/metrics/process.hpp"
#include "panelgate/profile/judge.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/web/event_text.hpp"

namespace panelgate::app {

std::unique_ptr<sim::SimulatedBus> simulate_line(boost::asio::any_io_executor executor,
                                                 const config::Line& line) {
    std::vector<sim::Station> stations;
    for (const config::Station& station : line.stations)
        stations.emplace_back(*station.profile, station.id);
    sim::Settings settings;
    settings.serial = line.device.serial;
    settings.echo = line.simulated_echo;
    for (const config::Station& station : line.stations)
        settings.faults[station.id] = station.faults;
    auto bus =
        std::make_unique<sim::SimulatedBus>(std::move(executor), settings, std::move(stations));
    rt::log(rt::LogLevel::info, "simulating", {{"line", line.name}, {"device", bus->device()}});
    return bus;
}

namespace {

/// How REST reaches the faults of a simulated panel; null for a real one. The bus outlives it.
std::shared_ptr<const web::SimulatedPanel> simulated_panel(sim::SimulatedBus* bus,
                                                           std::uint8_t station) {
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

void publish(web::EventHub& hub, const std::string& line,
             const std::map<std::uint8_t, std::string>& names, const bus::BusEvent& event) {
    if (hub.is_idle()) return;
    const auto named = names.find(event.station);
    const std::string station = event.station == 0     ? ""
                                : named != names.end() ? named->second
                                                       : std::to_string(event.station);
    switch (event.kind) {
        case bus::BusEvent::Kind::line:
            return hub.publish("line", web::line_event(line, event.what, event.why));
        case bus::BusEvent::Kind::station:
            return hub.publish("station", web::station_event(line, station, event.what));
        case bus::BusEvent::Kind::transaction:
            return hub.publish("transaction", web::transaction_event(line, station, event.function,
                                                                     event.what, event.took));
    }
    std::abort();
}

/// Refuses with 01, 02 or 03 what the panel's manual rules out. The profile outlives it.
bus::Guard guard_of(const profile::PanelProfile& profile) {
    return [&profile](const modbus::Request& request) -> std::optional<std::uint8_t> {
        switch (profile::judge(profile, request)) {
            case profile::Judgement::fine:
                return std::nullopt;
            case profile::Judgement::illegal_function:
                return std::uint8_t{1};
            case profile::Judgement::illegal_address:
            case profile::Judgement::write_protected:
                return std::uint8_t{2};
            case profile::Judgement::illegal_value:
                return std::uint8_t{3};
        }
        std::abort();
    };
}

Duration frame_gap(const config::Line& line, std::uint8_t station) {
    std::optional<Duration> gap = line.arbiter.unlisted.frame_gap;
    for (const arbiter::StationSettings& settings : line.arbiter.stations) {
        if (settings.id == station) gap = settings.frame_gap;
    }
    return gap.value_or(silent_interval(line.device.serial));
}

}  // namespace

Gateway::Gateway(boost::asio::any_io_executor executor, config::Config config, bool simulate)
    : executor_(std::move(executor)), config_(std::move(config)) {
    for (const config::Line& line : config_.lines) add_line(line, simulate);
    add_relays();
    for (const tcp_server::Settings& settings : config_.modbus_tcp) add_listener(settings);
    if (config_.http) add_http(*config_.http);
}

void Gateway::add_line(const config::Line& line, bool simulate) {
    bus::Settings settings;
    settings.name = line.name;
    settings.device = line.device.device;
    settings.arbiter = line.arbiter;
    for (const config::Station& station : line.stations) {
        settings.stations[station.id] = station.name;
        if (station.guard) settings.guards[station.id] = guard_of(*station.profile);
    }

    settings.observe = [this, name = line.name, names = settings.stations](
                           const bus::BusEvent& event) { publish(events_, name, names, event); };

    line::Settings device = line.device;
    const bool simulates = simulate || line.kind == config::Line::Kind::simulated;
    if (simulates) {
        simulated_.push_back(simulate_line(executor_, line));
        device.device = simulated_.back()->device();
        device.rs485 = {};
        settings.device = "sim";
    }
    const bool remote = line.kind == config::Line::Kind::tcp && !simulates;
    settings.arbiter.may_stall = remote;
    auto wire = remote ? line::make_tcp_line(executor_, std::move(device))
                       : line::make_tty_line(executor_, std::move(device));
    buses_.push_back(std::make_unique<bus::Bus>(executor_, std::move(settings), std::move(wire)));
    add_stations(line, *buses_.back(), simulates ? simulated_.back().get() : nullptr);
    add_points(line, *buses_.back());
}

void Gateway::add_stations(const config::Line& line, bus::Bus& bus, sim::SimulatedBus* simulated) {
    tcp_server::LineInfo info;
    info.name = line.name;
    info.bus = &bus;
    info.pass_unlisted = !line.refuse_unlisted;
    for (const config::Station& station : line.stations) {
        info.stations.push_back(station.id);
        if (station.read_only) info.read_only.push_back(station.id);
        web::StationEntry entry;
        entry.name = station.name;
        entry.line = line.name;
        entry.id = station.id;
        entry.profile = station.profile;
        entry.read_only = station.read_only;
        entry.bus = &bus;
        entry.simulated = simulated_panel(simulated, station.id);
        directory_.stations.push_back(std::move(entry));
    }
    lines_.push_back(std::move(info));
    directory_.lines.push_back({line.name, bus.status().device, &bus, !line.refuse_unlisted});
}

/// One poller a line. What it reads answers clients too, where a station's max_age allows it.
void Gateway::add_points(const config::Line& line, bus::Bus& bus) {
    std::vector<points::PolledStation> polled;
    std::vector<const config::Station*> configured;
    for (const config::Station& station : line.stations) {
        if (station.points.empty() && station.polls.empty()) continue;
        points::PolledStation entry;
        entry.id = station.id;
        entry.wants = points::wants_of(station.points, station.polls);
        entry.limits = points::make_plan_limits(*station.profile, line.device.serial,
                                                frame_gap(line, station.id));
        polled.push_back(std::move(entry));
        configured.push_back(&station);
    }
    if (polled.empty()) return;
    pollers_.push_back(std::make_unique<points::Poller>(executor_, bus, std::move(polled)));
    pollers_.back()->on_update(
        [this, first = points_.size()](std::size_t station, const auto& wants) {
            publish_points(first, wants, station);
        });
    for (std::size_t i = 0; i < configured.size(); ++i) {
        points_.emplace_back(configured[i]->points, configured[i]->polls,
                             pollers_.back()->station(i));
        for (web::StationEntry& entry : directory_.stations) {
            if (entry.name == configured[i]->name) entry.points = &points_.back();
        }
    }
}

/// What the points that these wants are have become. `first`: of the poller's stations in points_.
void Gateway::publish_points(std::size_t first, const std::vector<std::size_t>& wants,
                             std::size_t station) {
    if (events_.is_idle()) return;
    const points::StationPoints& points = points_[first + station];
    const auto entry = std::ranges::find(directory_.stations, &points, &web::StationEntry::points);
    const TimePoint now = rt::now();
    for (const std::size_t want : wants) {
        if (want >= points.points().size()) continue;  // a poll block
        const points::Point& point = points.points()[want];
        events_.publish("point", web::point_event(*entry, point, points.read(point, now)));
    }
}

void Gateway::add_relays() {
    const auto find = [&](const std::string& name) {
        return *std::ranges::find(directory_.stations, name, &web::StationEntry::name);
    };
    std::vector<points::RelayRoute> routes;
    for (const points::Relay& relay : config_.relays) {
        const web::StationEntry from = find(relay.from.station);
        const web::StationEntry to = find(relay.to.station);
        points::RelayRoute route;
        route.relay = relay;
        route.from = from.bus;
        route.from_station = from.id;
        route.to = to.bus;
        route.to_station = to.id;
        const auto multiple = modbus::is_bit_table(relay.to.table)
                                  ? modbus::kWriteMultipleCoils
                                  : modbus::kWriteMultipleRegisters;
        route.to_has_multiple = to.profile->has_function(multiple);
        routes.push_back(std::move(route));
    }
    relays_ = std::make_unique<points::Relays>(executor_, std::move(routes));
    relays_->on_state([](const points::RelayStatus& relay) {
        const auto level = relay.state == "ok" ? rt::LogLevel::info : rt::LogLevel::warn;
        rt::log(level, "relay", {{"relay", relay.name}, {"state", relay.state}});
    });
}

void Gateway::add_listener(const tcp_server::Settings& settings) {
    tcp_server::UnitMap units(settings, lines_);
    // What unit id reaches a station is shown by REST: the first listener that has one wins.
    for (web::StationEntry& station : directory_.stations) {
        for (int unit = 1; unit <= 255 && !station.unit; ++unit) {
            const auto target = units.route(static_cast<std::uint8_t>(unit));
            if (target && target->bus == station.bus && target->station == station.id)
                station.unit = unit;
        }
    }
    tcp_server::Hooks hooks;
    hooks.log = [](std::string_view text) { rt::log(rt::LogLevel::info, text); };
    hooks.version = PANELGATE_VERSION;
    listeners_.push_back(
        std::make_unique<tcp_server::Listener>(executor_, settings, std::move(units), hooks));
}

void Gateway::add_http(const web::Settings& settings) {
    web::Providers providers;
    providers.metrics_text = [this] { return metrics_text(); };
    providers.ready = [this] { return ready_; };
    providers.version = PANELGATE_VERSION;
    providers.now = rt::now;
    providers.events = &events_;
    providers.relays = [this] { return relays_->status(); };
    http_ = std::make_unique<web::Server>(executor_, settings, directory_, std::move(providers));
}

void Gateway::start() {
    for (const auto& simulated : simulated_) simulated->start();
    for (const auto& bus : buses_) bus->start();
    for (const auto& poller : pollers_) poller->start();
    relays_->start();
    for (std::size_t i = 0; i < listeners_.size(); ++i) {
        listeners_[i]->start();
        const std::string address =
            config_.modbus_tcp[i].address + ':' + std::to_string(listeners_[i]->port());
        rt::log(rt::LogLevel::info, "listening", {{"modbus_tcp", address}});
    }
    if (http_) {
        if (const auto error = http_->start()) {
            throw std::system_error(error, "cannot listen on " + config_.http->name());
        }
        const std::string address = config_.http->address + ':' + std::to_string(http_->port());
        rt::log(rt::LogLevel::info, "listening", {{"http", address}});
    }
    ready_ = true;
}

void Gateway::stop_accepting() {
    ready_ = false;
    events_.end();
    open_listeners_ = listeners_.size();
    for (const auto& listener : listeners_) {
        listener->stop([this] { --open_listeners_; });
    }
    if (http_) http_->stop();
}

bool Gateway::drained() const {
    return open_listeners_ == 0 && (!http_ || http_->connections() == 0);
}

void Gateway::stop() {
    for (const auto& listener : listeners_) listener->close_now();
    http_.reset();
    relays_->stop();
    for (const auto& poller : pollers_) poller->stop();
    for (const auto& bus : buses_) bus->stop();
    for (const auto& simulated : simulated_) simulated->stop();
}

std::vector<points::PointSample> Gateway::point_samples() const {
    std::vector<points::PointSample> samples;
    const TimePoint now = rt::now();
    for (const web::StationEntry& station : directory_.stations) {
        if (station.points == nullptr) continue;
        for (const points::Point& point : station.points->points()) {
            const points::PointReading reading = station.points->read(point, now);
            points::PointSample sample{station.line, station.name, point.name, point.unit, {}, {}};
            if (reading.value && reading.quality == points::Quality::good)
                sample.value = points::number_of(*reading.value);
            if (reading.age) sample.age = to_seconds(*reading.age);
            samples.push_back(std::move(sample));
        }
    }
    return samples;
}

std::vector<points::RelaySample> Gateway::relay_samples() const {
    std::vector<points::RelaySample> samples;
    for (const points::RelayStatus& relay : relays_->status()) {
        samples.push_back({relay.name, relay.state == "ok", relay.reads, relay.writes,
                           relay.read_failures, relay.write_failures});
    }
    return samples;
}

std::string Gateway::metrics_text() const {
    metrics::Snapshot snapshot;
    for (const auto& bus : buses_) snapshot.lines.push_back(bus->report());
    for (const auto& listener : listeners_) snapshot.listeners.push_back(listener->counters());
    snapshot.points = point_samples();
    snapshot.relays = relay_samples();
    snapshot.version = PANELGATE_VERSION;
    snapshot.process = metrics::read_process_facts();
    return metrics::exposition(snapshot);
}

}  // namespace panelgate::app
