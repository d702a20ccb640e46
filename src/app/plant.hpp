#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/sim/simulated_bus.hpp"
#include "panelgate/tcp_server/dispatch.hpp"

namespace panelgate::bus {
class BusClient;
}

namespace panelgate::app {

/// What a simulated line's device is called.
inline constexpr const char* kSimulatedDevice = "sim";

/// A line of the plant. What it refers to outlives the plant.
struct Line {
    const config::Line* configured = nullptr;  ///< never null
    std::string device;                        ///< as configured; kSimulatedDevice
    bus::BusClient* bus = nullptr;             ///< never null
};

/// A station that the configuration lists. What it refers to outlives the plant.
struct Station : bus::StationRef {
    const config::Station* configured = nullptr;  ///< never null
    /// Where its panel is played; null: a real one.
    std::shared_ptr<sim::SimulatedBus> simulated;
    std::optional<points::StationPoints> points;    ///< what its polls bring, when it has any
    std::optional<points::StationHistory> history;  ///< ... and have brought; where REST is served
    /// The id by which Modbus/TCP clients reach it: of the first listener that has one.
    std::optional<int> unit;
};

/// What there is: the lines and their stations. Whoever shows, copies or publishes looks them up
/// here. Filled at load, then constant; its stations do not move.
class Plant {
  public:
    /// A line with all its stations. `simulated`: null for a real one.
    void add(const config::Line& line, bus::BusClient& bus,
             const std::shared_ptr<sim::SimulatedBus>& simulated);
    /// What this listener's clients call the stations that no listener before it has reached.
    void add_units(const tcp_server::UnitMap& units);

    /// By the order of the configuration.
    const std::deque<Line>& lines() const { return lines_; }
    const std::deque<Station>& stations() const { return stations_; }

    const Station* find(std::string_view name) const;
    const Station* find(std::string_view line, std::uint8_t id) const;
    /// By Station::unit; where listeners differ, several have the same: the first of them.
    const Station* find_unit(int unit) const;
    /// Of a station that add() has brought.
    Station& at(std::string_view line, std::uint8_t id);
    std::deque<Station>& stations() { return stations_; }
    /// Its name, or its id when it is not listed; "" for everybody (station 0).
    std::string name_of(std::string_view line, std::uint8_t id) const;

    /// The lines as listeners see them.
    std::vector<tcp_server::LineInfo> listener_lines() const;

  private:
    std::deque<Line> lines_;
    std::deque<Station> stations_;
};

}  // namespace panelgate::app
