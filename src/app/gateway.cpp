#include "gateway.hpp"

#include <system_error>
#include <utility>

#include "panelgate/line/tcp_line.hpp"
#include "panelgate/line/tty_line.hpp"
#include "panelgate/metrics/exposition.hpp"
#include "panelgate/metrics/process.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::app {

std::unique_ptr<sim::SimulatedBus> simulate_line(boost::asio::any_io_executor executor,
                                                 const config::Line& line) {
    std::vector<sim::Station> stations;
    for (const config::Station& station : line.stations)
        stations.emplace_back(*station.profile, station.id);
    sim::Settings settings;
    settings.serial = line.device.serial;
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

}  // namespace

Gateway::Gateway(boost::asio::any_io_executor executor, config::Config config, bool simulate)
    : executor_(std::move(executor)), config_(std::move(config)) {
    for (const config::Line& line : config_.lines) add_line(line, simulate);
    for (const tcp_server::Settings& settings : config_.modbus_tcp) add_listener(settings);
    if (config_.http) add_http(*config_.http);
}

void Gateway::add_line(const config::Line& line, bool simulate) {
    bus::Settings settings;
    settings.name = line.name;
    settings.device = line.device.device;
    settings.arbiter = line.arbiter;
    for (const config::Station& station : line.stations)
        settings.stations[station.id] = station.name;

    line::Settings device = line.device;
    const bool simulates = simulate || line.kind == config::Line::Kind::simulated;
    if (simulates) {
        simulated_.push_back(simulate_line(executor_, line));
        device.device = simulated_.back()->device();
        settings.device = "sim";
    }
    const bool remote = line.kind == config::Line::Kind::tcp && !simulates;
    auto wire = remote ? line::make_tcp_line(executor_, std::move(device))
                       : line::make_tty_line(executor_, std::move(device));
    buses_.push_back(std::make_unique<bus::Bus>(executor_, std::move(settings), std::move(wire)));
    add_stations(line, *buses_.back(), simulates ? simulated_.back().get() : nullptr);
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
    http_ = std::make_unique<web::Server>(executor_, settings, directory_, std::move(providers));
}

void Gateway::start() {
    for (const auto& simulated : simulated_) simulated->start();
    for (const auto& bus : buses_) bus->start();
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
    for (const auto& bus : buses_) bus->stop();
    for (const auto& simulated : simulated_) simulated->stop();
}

std::string Gateway::metrics_text() const {
    metrics::Snapshot snapshot;
    for (const auto& bus : buses_) snapshot.lines.push_back(bus->report());
    for (const auto& listener : listeners_) snapshot.listeners.push_back(listener->counters());
    snapshot.version = PANELGATE_VERSION;
    snapshot.process = metrics::read_process_facts();
    return metrics::exposition(snapshot);
}

}  // namespace panelgate::app
