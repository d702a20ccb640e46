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
#include "panelgate/bus/last_minute.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/explain/translations.hpp"
#include "panelgate/gateway/plant.hpp"
#include "panelgate/gateway/second_way.hpp"
#include "panelgate/points/poller.hpp"
#include "panelgate/points/relays.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/sim/simulated_bus.hpp"
#include "panelgate/web/api/directory.hpp"

namespace panelgate::gateway {

/// The route of a relay whose stations the plant has; the configuration was checked.
points::RelayRoute route_of(const Plant& plant, const points::Relay& relay);

/// A simulated bus with the configured stations of a line.
std::shared_ptr<sim::SimulatedBus> simulate_line(boost::asio::any_io_executor executor,
                                                 rt::Clock& clock, const config::Line& line);

/// REST's access to the faults of a simulated panel; null for a real one (no bus).
std::shared_ptr<const web::SimulatedPanel> simulated_panel(
    const std::shared_ptr<sim::SimulatedBus>& bus, std::uint8_t station);

/// Callbacks for what happens on a line, named by the line.
struct LineWatch {
    std::function<void(const std::string& line, const bus::BusEvent& event)> event;
    /// These wants of a station's points have new values: indices of wants_of() in StationPoints.
    std::function<void(const std::string& line, std::uint8_t station,
                       const std::vector<std::size_t>& wants)>
        points;
    /// A write has ended; for an audit. May be empty.
    std::function<void(const std::string& line, const bus::WriteEnd& end)> write{};
    /// True if a frame may be sent over the line. May be empty.
    std::function<bool(const std::string& line)> may_send{};
    /// True while no write may be sent. May be empty.
    std::function<bool()> refuses_writes{};
    /// What doors say now. May be empty.
    std::function<std::optional<bus::Admission>(const WhoRef& who, const std::string& line,
                                                std::uint8_t station)>
        admit{};
    bus::TraceSettings trace{};  ///< sizes of the line's trace
};

/// What drives a line.
enum class Way : std::uint8_t {
    wire,      ///< an arbiter
    ethernet,  ///< requests by transaction id
    listens    ///< nothing: another master drives it
};
/// `simulate`: its panels are simulated, whatever its device is.
Way way_of(const config::Line& line, bool simulate);

/// A running line: bus, simulated panels, and poller or listener of the line. The bus stays the
/// same object through all reloads, so that clients may keep a reference; the bus of a removed line
/// is closed and stays. One thread.
class RunningLine {
  public:
    /// `simulate`: simulate it whatever its device is. The clock outlives it. Throws
    /// std::system_error if no pty is available.
    RunningLine(boost::asio::any_io_executor executor, rt::Clock& clock, const config::Line& line,
                bool simulate, LineWatch watch);
    RunningLine(const RunningLine&) = delete;
    RunningLine& operator=(const RunningLine&) = delete;

    void start();
    /// Closes the line, and gives back its descriptors, its simulated panels and its trace.
    void stop();
    /// Opens the line again after stop(), with the same configuration.
    void restart() { start(); }
    /// Destroys bus, poller and panels of the line. No other function may be called afterwards.
    void dispose();
    /// Applies a new configuration; `before` is the running one. Opens the line again after stop().
    void apply(const config::Line& before, const config::Line& now);

    /// Call each bus::LastMinute::kStep. Returns what last_minute() would.
    bus::MinuteUse record_minute();
    /// What was used of it in the last minute; nothing before the first record.
    bus::MinuteUse last_minute() const;

    bus::LineBus& bus() { return *bus_; }
    const bus::LineBus& bus() const { return *bus_; }
    const std::shared_ptr<sim::SimulatedBus>& simulated() const { return simulated_; }
    Way way() const { return way_; }
    /// Its device, and former ones on which replies may still be outstanding; links resolved.
    const std::set<std::string>& wires() const { return wires_; }
    /// The values of a station's points; nothing without any. The configuration outlives them, this
    /// object need not.
    std::optional<points::StationPoints> points_of(const config::Station& station) const;

  private:
    bus::Settings settings_of(const config::Line& line);
    std::unique_ptr<line::Line> make_wire(const config::Line& line);
    void apply_points(const config::Line& line);
    void forget_points();
    void apply_ways(const config::Line& line);
    void use_way(bool second);
    void on_event(const std::string& line, const bus::BusEvent& event);
    void hear(const std::string& line, const tap::Transaction& heard);

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    bool simulate_;
    Way way_;
    LineWatch watch_;
    /// For a line that is only listened to, by station.
    std::map<std::uint8_t, std::shared_ptr<points::HeardValues>> heard_;
    std::function<void(const bus::WriteEvent&)> write_listener_;  ///< the poller's
    std::shared_ptr<sim::SimulatedBus> simulated_;                ///< null for a real device
    std::unique_ptr<bus::LineBus> bus_;       ///< calls the members above until it is destroyed
    std::unique_ptr<points::Poller> poller_;  ///< null if nothing was ever polled
    std::set<std::string> wires_;
    bus::LastMinute minute_;
    /// Of a line with two devices: the line without its points, and what decides.
    std::optional<config::Line> configured_;
    std::unique_ptr<SecondWay> ways_;
    bool running_ = false;
};

}  // namespace panelgate::gateway
