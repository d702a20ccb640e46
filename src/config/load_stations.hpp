#pragma once

#include <optional>

#include "loader.hpp"
#include "panelgate/profile/notation.hpp"

namespace panelgate::config {

/// Timing as written; empty frame_gap = auto.
struct Timing {
    arbiter::StationSettings settings;
    std::optional<Duration> frame_gap;
    Duration think_time = 1ms;
    std::optional<yaml::Mark> unused_bound{};  ///< of an adaptive timeout, where there is none
};

/// A line while its stations are read.
struct LineContext {
    Line& line;
    /// False: its serial format had a fault, so nothing is checked against it.
    bool serial_known = true;
    Timing timing;
};

/// Reads `timing` of a line.
void load_line_timing(Loading& loading, yaml::MapReader& in, LineContext& work);
/// Returns a station's `timing` merged over its line's; resolves the frame gap with its profile and
/// sets the station's think time.
arbiter::StationSettings load_station_timing(Loading& loading, yaml::MapReader& in,
                                             const LineContext& work, Station& station);

/// Reads a line's `timing`, `retries` and `stations` and resolves the timing of every station.
/// Needs the line's serial format.
void load_stations(Loading& loading, yaml::MapReader& in, LineContext work);

/// Warns of a key that only a sending gateway uses, on a line that is only listened to.
void warn_of_unused_key(Loading& loading, yaml::MapReader& in, std::string_view key);

/// Checks a template that no station names as a station's body, so that its faults are found before
/// use. Without a profile it is checked with the one that it fits best.
void check_template(Loading& loading, const yaml::Node& body);

/// Warns of what cannot end before the queue's deadline, once for each cause: a response timeout,
/// or a read on this wire. `node` is the whole line's.
void warn_of_deadline(Loading& loading, const yaml::Node& node, const Line& line);

/// Reads `poll` and `points` of a station.
void load_points(Loading& loading, yaml::MapReader& in, Station& station);
/// Reads a required key that names an item in the panel's notation.
std::optional<profile::Item> load_notation(yaml::MapReader& in, std::string_view key,
                                           const profile::PanelProfile& profile);
/// Adds a problem at `key` if the panel does not return this many items in one read.
void check_read_count(yaml::MapReader& in, std::string_view key,
                      const profile::PanelProfile& profile, modbus::Table table,
                      std::uint32_t count);

}  // namespace panelgate::config
