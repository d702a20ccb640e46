#include "gateway.hpp"

#include <system_error>
#include <utility>
#include <variant>

#include "panelgate/line/tcp_line.hpp"
#include "panelgate/line/tty_line.hpp"
#include "panelgate/metrics/exposition.hpp"
#include "panelgate/metrics/process.hpp"
#include "panelgate/rt/log.hpp"
#include "showing.hpp"
#include "simulated_line.hpp"
#include "wiring.hpp"

namespace panelgate::app {

Gateway::Gateway(boost::asio::any_io_executor executor, config::Config config, bool simulate)
    : executor_(std::move(executor)), clock_(executor_), config_(std::move(config)) {
    for (const config::Line& line : config_.lines) add_line(line, simulate);
    add_relays();
    for (const tcp_server::Settings& settings : config_.modbus_tcp) add_listener(settings);
    if (config_.http) add_http(*config_.http);
}

void Gateway::add_line(const config::Line& line, bool simulate) {
    bus::Settings settings = bus_settings(line);
    settings.observe = [this, name = line.name](const bus::BusEvent& event) {
        on_bus_event(name, event);
    };
    line::Settings device = line.device;
    sim::SimulatedBus* simulated = nullptr;
    if (simulate || line.kind == config::Line::Kind::simulated) {
        simulated_.push_back(simulate_line(executor_, clock_, line));
        simulated = simulated_.back().get();
        device.device = simulated->device();
        device.rs485 = {};
        settings.device = kSimulatedDevice;
    }
    const bool remote = line.kind == config::Line::Kind::tcp && simulated == nullptr;
    settings.arbiter.may_stall = remote;
    auto wire = remote ? line::make_tcp_line(executor_, clock_, std::move(device))
                       : line::make_tty_line(executor_, clock_, std::move(device));
    buses_.push_back(
        std::make_unique<bus::Bus>(executor_, clock_, std::move(settings), std::move(wire)));
    plant_.add(line, *buses_.back(), simulated);
    add_poller(line, *buses_.back());
}

void Gateway::on_bus_event(const std::string& line, const bus::BusEvent& event) {
    publish(events_, plant_, line, event);
    const auto* write = std::get_if<bus::WriteEvent>(&event);
    const auto listener = write_listeners_.find(line);
    if (write != nullptr && listener != write_listeners_.end()) listener->second(*write);
}

/// One a line. What it reads answers clients too, where a station's max_age allows it.
void Gateway::add_poller(const config::Line& line, bus::Bus& bus) {
    auto polled = polled_stations(line);
    if (polled.empty()) return;
    pollers_.push_back(std::make_unique<points::Poller>(clock_, bus, std::move(polled)));
    points::Poller& poller = *pollers_.back();
    for (const config::Station& station : line.stations) {
        const points::StationPolls* polls = poller.find(station.id);
        if (polls == nullptr) continue;
        plant_.at(line.name, station.id).points.emplace(station.points, station.polls, *polls);
    }
    write_listeners_[line.name] = poller.write_listener();
    poller.on_update([this, name = line.name](std::uint8_t id, const auto& wants) {
        publish_points(events_, plant_.at(name, id), wants, clock_.now());
    });
}

void Gateway::add_relays() {
    std::vector<points::RelayRoute> routes;
    for (const points::Relay& relay : config_.relays) routes.push_back(route_of(plant_, relay));
    relays_ = std::make_unique<points::Relays>(clock_, std::move(routes));
    relays_->on_state([](const points::RelayStatus& relay) {
        const bool ok = relay.state == points::RelayState::ok;
        rt::log(ok ? rt::LogLevel::info : rt::LogLevel::warn, "relay",
                {{"relay", relay.name}, {"state", text_of(relay)}});
    });
}

void Gateway::add_listener(const tcp_server::Settings& settings) {
    tcp_server::UnitMap units(settings, plant_.listener_lines());
    plant_.add_units(units);
    listeners_.push_back(std::make_unique<tcp_server::Listener>(
        executor_, clock_, settings, std::move(units), PANELGATE_VERSION));
}

void Gateway::add_http(const web::Settings& settings) {
    web::Providers providers;
    providers.metrics_text = [this] { return metrics_text(); };
    providers.metrics_type = metrics::kContentType;
    providers.ready = [this] { return ready_; };
    providers.version = PANELGATE_VERSION;
    providers.now = [this] { return clock_.now(); };
    providers.events = &events_;
    providers.relays = [this] { return relays_->status(); };
    directory_ = directory_of(plant_, *config_.profiles->find("generic"));
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

std::string Gateway::metrics_text() const {
    metrics::Snapshot snapshot;
    for (const auto& bus : buses_) snapshot.lines.push_back(bus->report());
    for (const auto& listener : listeners_) snapshot.listeners.push_back(listener->counters());
    snapshot.points = point_samples(plant_, clock_.now());
    snapshot.relays = relay_samples(relays_->status());
    if (http_) snapshot.http = http_->counters();
    snapshot.version = PANELGATE_VERSION;
    snapshot.process = metrics::read_process_facts();
    snapshot.runtime.log_lines_dropped = rt::log_lines_dropped();
    return metrics::exposition(snapshot);
}

}  // namespace panelgate::app
