#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/explain/unit_map.hpp"
#include "panelgate/points/report.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/sim/simulated_bus.hpp"
#include "panelgate/tcp_server/unit_map.hpp"

namespace panelgate::bus {
class BusClient;
}

namespace panelgate::gateway {

/// The device name of a simulated line.
inline constexpr const char* kSimulatedDevice = "sim";

/// A line of the plant. What it refers to outlives the plant.
struct Line {
    const config::Line* configured = nullptr;  ///< never null
    std::string device;                        ///< as configured, or kSimulatedDevice
    bus::BusClient* bus = nullptr;             ///< never null
};

/// A station of the configuration. The profile and settings of the station outlive the plant.
struct Station : bus::StationRef {
    const config::Station* configured = nullptr;  ///< never null
    /// The bus that simulates its panel; null for a real one.
    std::shared_ptr<sim::SimulatedBus> simulated;
    std::optional<points::StationPoints> points;    ///< the values of its polls, if it has points
    std::optional<points::StationHistory> history;  ///< their history, if REST is served
    /// What events have told of points with a report rule, by point.
    std::map<std::size_t, points::Told> told;
    /// The unit id of the station at the first listener that serves the station.
    std::optional<int> unit;
};

/// The lines and their stations, looked up by REST, /metrics, events and MQTT. Filled at load, then
/// constant; its stations do not move.
class Plant {
  public:
    /// Adds a line with all its stations. `simulated`: null for a real line.
    void add(const config::Line& line, bus::BusClient& bus,
             const std::shared_ptr<sim::SimulatedBus>& simulated);
    /// Adds an image, which listeners serve by `bus`.
    void add(const images::Settings& image, const config::Config& config, bus::BusClient& bus) {
        images_.push_back(explain::image_info(image, config));
        images_.back().bus = &bus;
    }
    /// Sets the unit ids of this listener for the stations that no earlier listener has reached.
    void add_units(const tcp_server::UnitMap& units);

    /// In the order of the configuration.
    const std::deque<Line>& lines() const { return lines_; }
    const std::deque<Station>& stations() const { return stations_; }

    const Station* find(std::string_view name) const;
    const Station* find(std::string_view line, std::uint8_t id) const;
    /// Finds a station by Station::unit; if several have the same, the first one.
    const Station* find_unit(int unit) const;
    /// The station, which add() must have added; throws std::logic_error otherwise.
    Station& at(std::string_view line, std::uint8_t id);
    std::deque<Station>& stations() { return stations_; }
    /// The station's name, or its id if it is not listed; "" for a broadcast (station 0).
    std::string name_of(std::string_view line, std::uint8_t id) const;

    /// The lines and images as listeners see them.
    std::vector<tcp_server::LineInfo> listener_lines(
        explain::Unlisted unlisted = explain::Unlisted::as_the_line) const;

  private:
    std::deque<Line> lines_;
    std::vector<tcp_server::LineInfo> images_;
    std::deque<Station> stations_;
};

}  // namespace panelgate::gateway
