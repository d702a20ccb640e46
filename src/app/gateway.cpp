#include "gateway.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/ip/host_name.hpp>
#include <charconv>
#include <memory>
#include <random>
#include <string>
#include <system_error>
#include <utility>
#include <variant>

#include "address_families.hpp"
#include "inventory.hpp"
#include "panelgate/bus/listening_bus.hpp"
#include "panelgate/line/tcp_line.hpp"
#include "panelgate/line/tty_line.hpp"
#include "panelgate/metrics/exposition.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "simulated_line.hpp"
#include "wiring.hpp"

namespace panelgate::app {

namespace {

boost::system::error_code error_of(tcp_server::Listener& listener) {
    try {
        listener.start();
    } catch (const std::system_error& error) {
        return error.code();
    }
    return {};
}

/// Of the ids of events: another one in each life of the program.
std::string new_epoch() {
    constexpr int kHex = 16;
    std::array<char, 8> text{};
    const auto [end, wrong] =
        std::to_chars(text.data(), text.data() + text.size(), std::random_device()(), kHex);
    return std::string(text.data(), end);
}

}  // namespace

Gateway::Gateway(boost::asio::any_io_executor executor, config::Config config, bool simulate)
    : executor_(std::move(executor)),
      clock_(executor_),
      config_(std::move(config)),
      events_(new_epoch()) {
    separate_families(config_);
    for (const config::Line& line : config_.lines) add_line(line, simulate);
    add_relays();
    for (const tcp_server::Settings& settings : config_.modbus_tcp) add_listener(settings);
    for (const serial_server::Settings& settings : config_.serial_masters)
        add_serial_master(settings);
    if (config_.http) add_http(*config_.http);
    if (config_.mqtt)
        northbound_ = std::make_unique<Northbound>(executor_, clock_, *config_.mqtt, plant_);
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
        device.simulated = true;
        settings.device = kSimulatedDevice;
    }
    const bool remote = line.kind == config::Line::Kind::tcp && simulated == nullptr;
    settings.arbiter.may_stall = remote;
    auto wire = remote ? line::make_tcp_line(executor_, clock_, std::move(device))
                       : line::make_tty_line(executor_, clock_, std::move(device));
    if (line.listens) {
        buses_.push_back(std::make_unique<bus::ListeningBus>(executor_, clock_, std::move(settings),
                                                             std::move(wire)));
    } else {
        buses_.push_back(
            std::make_unique<bus::Bus>(executor_, clock_, std::move(settings), std::move(wire)));
    }
    plant_.add(line, *buses_.back(), simulated);
    add_points(line, *buses_.back());
}

void Gateway::on_bus_event(const std::string& line, const bus::BusEvent& event) {
    publish(events_, plant_, line, event);
    if (northbound_) northbound_->on_bus_event(line, event);
    if (const auto* heard = std::get_if<tap::Transaction>(&event)) hear(line, *heard);
    const auto* write = std::get_if<bus::WriteEvent>(&event);
    if (write == nullptr) return;
    const auto listener = write_listeners_.find(line);
    if (listener != write_listeners_.end()) listener->second(*write);
    if (relay_listener_) relay_listener_(line, *write);
}

void Gateway::add_points(const config::Line& line, bus::LineBus& bus) {
    auto wanted = polled_stations(line);
    if (wanted.empty()) return;
    if (line.listens) return add_heard(line, wanted);
    add_poller(line, std::move(wanted), bus);
}

void Gateway::add_heard(const config::Line& line,
                        const std::vector<points::PolledStation>& wanted) {
    for (const points::PolledStation& one : wanted) {
        const auto [heard, added] = heard_.try_emplace({line.name, one.id}, one.wants, one.memory);
        Station& station = plant_.at(line.name, one.id);
        const config::Station& configured = *station.configured;
        station.points.emplace(configured.points, configured.polls, heard->second.readings());
    }
}

/// A broadcast is to all of them.
void Gateway::hear(const std::string& line, const tap::Transaction& heard) {
    for (auto& [place, values] : heard_) {
        if (place.first != line || (heard.station != 0 && heard.station != place.second)) continue;
        const auto wants = values.on_heard(heard);
        if (!wants.empty()) on_points(line, place.second, wants);
    }
}

void Gateway::on_points(const std::string& line, std::uint8_t id,
                        const std::vector<std::size_t>& wants) {
    Station& station = plant_.at(line, id);
    remember(station, wants, clock_.now());
    publish_points(events_, station, wants, clock_.now());
    if (northbound_) northbound_->on_points(station, wants);
}

/// Who serves nobody keeps nothing.
void Gateway::keep_histories() {
    std::size_t points = 0;
    for (const Station& station : plant_.stations())
        points += station.points ? station.points->points().size() : 0;
    const Duration width = points::StationHistory::width_for(points);
    for (const Station& station : plant_.stations()) {
        if (!station.points) continue;
        plant_.at(station.line, station.id).history.emplace(station.points->points(), width);
    }
    std::vector<const bus::LineBus*> lines;
    for (const auto& bus : buses_) lines.push_back(bus.get());
    line_histories_ = std::make_unique<LineHistories>(clock_, std::move(lines));
}

/// One a line. What it reads answers clients too, where a station's max_age allows it.
void Gateway::add_poller(const config::Line& line, std::vector<points::PolledStation> polled,
                         bus::LineBus& bus) {
    pollers_.push_back(std::make_unique<points::Poller>(clock_, bus, std::move(polled)));
    points::Poller& poller = *pollers_.back();
    for (const config::Station& station : line.stations) {
        const points::StationPolls* polls = poller.find(station.id);
        if (polls == nullptr) continue;
        plant_.at(line.name, station.id).points.emplace(station.points, station.polls, *polls);
    }
    write_listeners_[line.name] = poller.write_listener();
    poller.on_update([this, name = line.name](std::uint8_t id, const auto& wants) {
        on_points(name, id, wants);
    });
}

void Gateway::add_relays() {
    std::vector<points::RelayRoute> routes;
    for (const points::Relay& relay : config_.relays) routes.push_back(route_of(plant_, relay));
    relays_ = std::make_unique<points::Relays>(clock_, std::move(routes));
    relay_listener_ = relays_->write_listener();
    relays_->on_state([](const points::RelayStatus& relay) {
        const bool ok = relay.state == points::RelayState::ok;
        rt::log_about(relay.name, ok ? rt::LogLevel::info : rt::LogLevel::warn, "relay",
                      {{"relay", relay.name}, {"state", text_of(relay)}});
    });
}

void Gateway::add_listener(tcp_server::Settings settings) {
    boost::system::error_code unknown;
    settings.host = boost::asio::ip::host_name(unknown);
    if (config_.http) settings.url = "http://" + config_.http->name() + '/';
    tcp_server::UnitMap units(settings, plant_.listener_lines());
    plant_.add_units(units);
    listeners_.push_back(std::make_unique<tcp_server::Listener>(
        executor_, clock_, std::move(settings), std::move(units), PANELGATE_VERSION));
}

/// Who else answers on the master's line is not ours to speak for: only what is listed is served.
void Gateway::add_serial_master(const serial_server::Settings& settings) {
    auto lines = plant_.listener_lines();
    for (tcp_server::LineInfo& line : lines) line.pass_unlisted = false;
    serial_masters_.push_back(std::make_unique<serial_server::SerialMaster>(
        clock_, settings, tcp_server::UnitMap(settings.access, lines),
        line::make_tty_line(executor_, clock_, settings.device)));
}

void Gateway::add_http(const web::Settings& settings) {
    web::Providers providers;
    const auto copy = [this] {
        return [this, points = PointCopy(plant_)](metrics::Snapshot& into) mutable {
            return copy_figures(into, points);
        };
    };
    scrapes_ = std::make_unique<Scrapes>(executor_, copy, Scrapes::Settings{});
    providers.metrics = scrapes_.get();
    providers.metrics_type = metrics::kContentType;
    providers.ready = [this] { return ready_ && openings_.missing().empty(); };
    providers.missing = [this] { return openings_.missing(); };
    providers.version = PANELGATE_VERSION;
    providers.now = [this] { return clock_.now(); };
    providers.events = &events_;
    providers.relays = [this] { return relays_->status(); };
    providers.configuration =
        std::make_shared<const std::string>(web::json_text(inventory_json(config_)));
    providers.wall = rt::wall_now;
    discoveries_ = std::make_unique<Discoveries>(clock_, plant_, *config_.profiles, events_);
    providers.discovery = discoveries_.get();
    keep_histories();
    directory_ = directory_of(plant_, *config_.profiles->find("generic"));
    for (std::size_t i = 0; i < buses_.size(); ++i)
        directory_.lines[i].history = &line_histories_->at(i);
    http_ = std::make_unique<web::Server>(executor_, settings, directory_, std::move(providers));
}

void Gateway::add_doors() {
    for (std::size_t i = 0; i < listeners_.size(); ++i) {
        const tcp_server::Settings& settings = config_.modbus_tcp[i];
        tcp_server::Listener* listener = listeners_[i].get();
        openings_.add({"modbus_tcp", settings.address, settings.port,
                       [listener] { return error_of(*listener); },
                       [listener] { return listener->port(); }});
    }
    if (!http_) return;
    openings_.add({"http", config_.http->address, config_.http->port,
                   [this] { return http_->start(); }, [this] { return http_->port(); }});
}

void Gateway::start() {
    lag_.start();
    for (const auto& simulated : simulated_) simulated->start();
    for (const auto& bus : buses_) bus->start();
    for (const auto& poller : pollers_) poller->start();
    relays_->start();
    if (line_histories_) line_histories_->start();
    if (northbound_) northbound_->start();
    for (const auto& master : serial_masters_) master->start();
    add_doors();
    openings_.start();
    ready_ = true;
}

Duration Gateway::longest_answer() const {
    Duration longest{};
    for (const config::Line& line : config_.lines)
        longest = std::max(longest, line.arbiter.queue.deadline);
    return longest;
}

void Gateway::stop_accepting() {
    ready_ = false;
    openings_.stop();
    if (discoveries_) discoveries_->stop_all();
    events_.end();
    open_listeners_ = listeners_.size();
    for (const auto& listener : listeners_) {
        listener->stop([this] { --open_listeners_; });
    }
    for (const auto& master : serial_masters_) master->finish();
    if (http_) http_->stop(longest_answer());
}

bool Gateway::drained() const {
    const auto idle = [](const auto& master) { return master->idle(); };
    return open_listeners_ == 0 && std::ranges::all_of(serial_masters_, idle) &&
           (!http_ || http_->connections() == 0);
}

std::size_t Gateway::owing() const {
    std::size_t count = http_ ? http_->connections() : 0;
    for (const auto& listener : listeners_) count += listener->counters().connections;
    for (const auto& master : serial_masters_) count += master->idle() ? 0 : 1;
    return count;
}

void Gateway::stop() {
    lag_.stop();
    for (const auto& listener : listeners_) listener->close_now();
    for (const auto& master : serial_masters_) master->stop();
    http_.reset();
    if (northbound_) northbound_->stop();
    if (line_histories_) line_histories_->stop();
    relays_->stop();
    for (const auto& poller : pollers_) poller->stop();
    for (const auto& bus : buses_) bus->stop();
    for (const auto& simulated : simulated_) simulated->stop();
}

/// One piece: a line, some points, or all the rest, which is small.
bool Gateway::copy_figures(metrics::Snapshot& snapshot, PointCopy& points) const {
    const std::size_t lines = snapshot.lines.size();
    if (lines < buses_.size()) {
        snapshot.lines.push_back(buses_[lines]->report());
        return true;
    }
    if (points.next(snapshot.points, clock_.now())) return true;
    for (const auto& listener : listeners_) snapshot.listeners.push_back(listener->counters());
    for (const auto& master : serial_masters_)
        snapshot.serial_masters.push_back(master->counters());
    snapshot.relays = relay_samples(relays_->status());
    if (http_) snapshot.http = http_->counters();
    if (northbound_) snapshot.mqtt = northbound_->counters();
    snapshot.version = PANELGATE_VERSION;
    snapshot.runtime.log_lines_dropped = rt::log_lines_dropped();
    snapshot.runtime.loop_lag = lag_.seconds();
    return false;
}

}  // namespace panelgate::app
