#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
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
    Duration deadline = 2s;                     ///< of a request, from its arrival to its answer
    SerialFormat serial{};                      ///< what a read costs follows from it
    const bus::LineHistory* history = nullptr;  ///< null: nothing is kept; outlives the directory
};

/// The faults of a simulated panel, in numbers by name.
struct SimulatedPanel {
    std::function<std::map<std::string, double>()> faults;
    /// What is not named is off. Nothing, or what is wrong.
    std::function<std::optional<std::string>(const std::map<std::string, double>&)> set_faults;
};

struct StationEntry : bus::StationRef {
    const profile::PanelProfile* profile = nullptr;  ///< never null; outlives the directory
    /// Nobody has said what panel it is: `profile` is `generic`, and not shown as the panel's.
    bool unknown_panel = false;
    bool read_only = false;
    std::optional<int> unit;  ///< the unit id that Modbus/TCP clients use, when there is one
    const points::StationPoints* points = nullptr;    ///< null without any; outlives the directory
    const points::StationHistory* history = nullptr;  ///< of them; null where nothing is kept
    std::shared_ptr<const SimulatedPanel> simulated;  ///< null for a real panel
};

/// What the API serves: the view that it needs of the plant. Constant; a changed plant has another
/// one.
struct Directory {
    const profile::PanelProfile* generic = nullptr;  ///< of stations that nobody has listed
    std::vector<LineEntry> lines;
    std::vector<StationEntry> stations;

    const LineEntry* find_line(std::string_view name) const;
    /// Of a station that has a bus, whose line is always there.
    const LineEntry& line_of(const StationEntry& station) const;
    /// By name or as LINE:ID; an unlisted id (1..247) is found where its line passes those.
    std::optional<StationEntry> find_station(std::string_view name) const;
};

}  // namespace panelgate::web
