#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/points/heard_values.hpp"
#include "panelgate/points/poller.hpp"
#include "panelgate/points/relays.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/sim/simulated_bus.hpp"
#include "panelgate/web/api/directory.hpp"
#include "plant.hpp"

namespace panelgate::app {

// What the configuration means to each module.

bus::Settings bus_settings(const config::Line& line);
/// The stations that have points or poll blocks.
std::vector<points::PolledStation> polled_stations(const config::Line& line);
/// Which items are shown elsewhere as well.
points::SharedMemory memory_of(const profile::ProfileRef& panel);
/// The panel has function 15 or 16 for this table.
bool takes_multiple(const profile::PanelProfile& panel, modbus::Table table);
/// A relay whose ends the plant has: the configuration was checked.
points::RelayRoute route_of(const Plant& plant, const points::Relay& relay);

/// A simulated bus with the configured stations of a line.
std::shared_ptr<sim::SimulatedBus> simulate_line(boost::asio::any_io_executor executor,
                                                 rt::Clock& clock, const config::Line& line);

/// How REST reaches the faults of a simulated panel; null for a real one (no bus).
std::shared_ptr<const web::SimulatedPanel> simulated_panel(
    const std::shared_ptr<sim::SimulatedBus>& bus, std::uint8_t station);

/// Whoever is told what happens on a line, by its name.
struct LineWatch {
    std::function<void(const std::string& line, const bus::BusEvent& event)> event;
    /// These wants of a station's points are others now: of StationPoints, by wants_of().
    std::function<void(const std::string& line, std::uint8_t station,
                       const std::vector<std::size_t>& wants)>
        points;
};

/// What it is on, whatever the line is called: its device through links, or the far end.
std::string wire_of(const config::Line& line);
/// The line goes on as it is: nothing that has to be right before the first byte is another.
bool is_same_wire(const config::Line& before, const config::Line& now, bool simulate);

/// One line as it runs: its bus, the panels that are simulated for it, and what is polled or heard
/// on it. Its bus is the same object through all reloads, so that whoever knows it may go on
/// asking; of a line that is configured no more it is closed and stays. One thread.
class RunningLine {
  public:
    /// `simulate`: whatever its device. The clock outlives it. Throws std::system_error when there
    /// is no pty left.
    RunningLine(boost::asio::any_io_executor executor, rt::Clock& clock, const config::Line& line,
                bool simulate, LineWatch watch);
    RunningLine(const RunningLine&) = delete;
    RunningLine& operator=(const RunningLine&) = delete;

    void start();
    void stop();
    /// The end: nothing of it is there any more. Whoever still holds it may only let it go.
    void dispose();
    /// Goes on as this; `before` is what it was. Opens it again after stop().
    void apply(const config::Line& before, const config::Line& now);

    bus::LineBus& bus() { return *bus_; }
    const bus::LineBus& bus() const { return *bus_; }
    const std::shared_ptr<sim::SimulatedBus>& simulated() const { return simulated_; }
    bool listens() const { return listens_; }
    /// Its device, and those that it may still be waited for on; through links.
    const std::set<std::string>& wires() const { return wires_; }
    /// What is known of its points; nothing without any. The configuration outlives it, not this.
    std::optional<points::StationPoints> points_of(const config::Station& station) const;

  private:
    bus::Settings settings_of(const config::Line& line);
    std::unique_ptr<line::Line> make_wire(const config::Line& line);
    void apply_points(const config::Line& line);
    void forget_points();
    void on_event(const std::string& line, const bus::BusEvent& event);
    void hear(const std::string& line, const tap::Transaction& heard);

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    bool simulate_;
    bool listens_;
    LineWatch watch_;
    /// Of a line that is only listened to, by station.
    std::map<std::uint8_t, std::shared_ptr<points::HeardValues>> heard_;
    std::function<void(const bus::WriteEvent&)> write_listener_;  ///< the poller's
    std::shared_ptr<sim::SimulatedBus> simulated_;                ///< null for a real device
    std::unique_ptr<bus::LineBus> bus_;                           ///< tells those above to its end
    std::unique_ptr<points::Poller> poller_;  ///< null where nothing was ever polled
    std::set<std::string> wires_;
    bool running_ = false;
};

}  // namespace panelgate::app
