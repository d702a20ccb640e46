#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/images/layout.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::bus {
class LineHistory;
}
namespace panelgate::points {
class StationHistory;
}

namespace panelgate::web {

struct LineEntry {
    std::string name;
    std::string device;             ///< as configured
    bus::BusClient* bus = nullptr;  ///< never null; outlives the directory
    bool pass_unlisted_stations = true;
    Duration deadline = 2s;  ///< longest time from a request's arrival to its answer
    SerialFormat serial{};   ///< needed to compute the bus time of a read
    const bus::LineHistory* history = nullptr;  ///< null: no history; outlives the directory
    std::shared_ptr<const access::LineRules> access{};  ///< null: everybody may do everything
};

/// Reads and sets the simulated faults of a panel, by name.
struct SimulatedPanel {
    std::function<std::map<std::string, double>()> faults;
    /// Faults that are not named are switched off. Returns the error, or nothing on success.
    std::function<std::optional<std::string>(const std::map<std::string, double>&)> set_faults;
};

struct StationEntry : bus::StationRef {
    const profile::PanelProfile* profile = nullptr;  ///< never null; outlives the directory
    /// The panel type is unknown: `profile` is `generic` and is not shown as the panel's own.
    bool unknown_panel = false;
    bool read_only = false;
    std::optional<int> unit;  ///< the unit id that Modbus/TCP clients use, if any
    const points::StationPoints* points = nullptr;  ///< null if it has none; outlives the directory
    const points::StationHistory* history = nullptr;  ///< of its points; null if no history is kept
    std::shared_ptr<const SimulatedPanel> simulated;  ///< null for a real panel
};

struct ImageEntry {
    const images::Settings* settings = nullptr;  ///< never null; outlives the directory
    images::Layout layout{};
};

/// The part of the plant that the API needs. Immutable; a changed plant gets a new one.
struct Directory {
    const profile::PanelProfile* generic = nullptr;  ///< for unlisted stations
    std::vector<LineEntry> lines;
    std::vector<StationEntry> stations;
    std::vector<ImageEntry> images{};

    const LineEntry* find_line(std::string_view name) const;
    /// The line of a station; the station must have a bus.
    const LineEntry& line_of(const StationEntry& station) const;
    /// Finds a station by name or as LINE:ID. An unlisted id (1 to 247) is found if its line passes
    /// unlisted stations.
    std::optional<StationEntry> find_station(std::string_view name) const;
};

}  // namespace panelgate::web
