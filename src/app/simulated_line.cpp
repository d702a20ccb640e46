#include "simulated_line.hpp"

#include <memory>
#include <utility>
#include <vector>

#include "panelgate/rt/log.hpp"
#include "panelgate/sim/misbehaviour.hpp"
#include "panelgate/sim/station.hpp"

namespace panelgate::app {
namespace {

struct Played {
    std::vector<profile::ProfileRef> panels;  ///< what the bus's stations refer to
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

}  // namespace panelgate::app
