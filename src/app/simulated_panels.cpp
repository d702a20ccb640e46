#include "simulated_panels.hpp"

#include <system_error>
#include <utility>

#include "build_info.hpp"
#include "panelgate/base/endpoint_text.hpp"
#include "panelgate/rt/log.hpp"
#include "simulated_line.hpp"

namespace panelgate::app {

SimulatedPanels::SimulatedPanels(boost::asio::any_io_executor executor)
    : executor_(std::move(executor)), clock_(executor_) {}

void SimulatedPanels::add(const config::Line& line, const std::string& link) {
    buses_.push_back(simulate_line(executor_, clock_, line));
    sim::SimulatedBus& bus = *buses_.back();
    bus.start();
    text_ += "line " + line.name + ": " + lead_to(line.name, bus.device(), link) + ", " +
             to_string(line.device.serial) + '\n';
    for (const config::Station& station : line.stations) {
        text_ += "  station " + std::to_string(station.id) + ' ' + station.name + ", " +
                 station.profile->name + '\n';
        web::StationEntry& entry = directory_.stations.emplace_back();
        entry.name = station.name;
        entry.line = line.name;
        entry.id = station.id;
        entry.profile = station.profile;
        entry.simulated = simulated_panel(buses_.back(), station.id);
    }
}

std::string SimulatedPanels::lead_to(const std::string& line, const std::string& device,
                                     const std::string& link) {
    if (link.empty()) return device;
    if (!link.starts_with(kTcpLink)) {
        links_.push_back(std::make_unique<PtyLink>(link, device));
        return link + " -> " + device;
    }
    const auto endpoint = config::parse_endpoint(link.substr(kTcpLink.size()));
    bridges_.push_back(std::make_unique<TcpBridge>(executor_, *endpoint, device));
    const std::string place = endpoint_text(endpoint->address, bridges_.back()->port());
    rt::log(rt::LogLevel::info, "listening", {{"line", line}, {"rtu_over_tcp", place}});
    return std::string(kTcpLink) + place;
}

void SimulatedPanels::serve_faults(const config::Endpoint& endpoint) {
    web::Settings settings;
    settings.address = endpoint.address;
    settings.port = endpoint.port;
    settings.anonymous = web::Role::operator_;
    web::Providers providers;
    providers.ready = [] { return true; };
    providers.missing = [] { return std::string(); };
    providers.version = PANELGATE_VERSION;
    providers.commit = build_commit();
    providers.compiler = build_compiler();
    providers.libraries = build_libraries();
    providers.now = [this] { return clock_.now(); };
    providers.events = &nothing_happens_;
    http_ = std::make_unique<web::Server>(executor_, settings,
                                          std::make_shared<const web::Directory>(directory_),
                                          std::move(providers), web::Surface::simulator);
    if (const auto error = http_->start())
        throw std::system_error(error, "cannot listen on " + settings.name());
    const std::string place = endpoint_text(endpoint.address, http_->port());
    rt::log(rt::LogLevel::info, "listening", {{"http", place}});
    text_ += "faults: http://" + place + "/api/v1/simulator/{station}\n";
}

void SimulatedPanels::stop() {
    http_.reset();
    bridges_.clear();
    for (const auto& bus : buses_) bus->stop();
}

}  // namespace panelgate::app
