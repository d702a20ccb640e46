#pragma once

#include <optional>

#include "loader.hpp"
#include "panelgate/profile/notation.hpp"

namespace panelgate::config {

/// Timing as written; no frame_gap = auto.
struct Timing {
    arbiter::StationSettings settings;
    std::optional<Duration> frame_gap;
    Duration think_time = 1ms;
};

/// A line while its stations are read.
struct LineInWork {
    Line& line;
    /// False: its serial format had a fault, so nothing is held against it.
    bool serial_known = true;
    Timing timing;
};

/// `timing` of a line.
void load_line_timing(Loading& loading, yaml::MapReader& in, LineInWork& work);
/// `timing` of a station, over its line's; the frame gap resolved with its profile, the think time
/// given to the station.
arbiter::StationSettings load_station_timing(Loading& loading, yaml::MapReader& in,
                                             const LineInWork& work, Station& station);

/// Reads a line's `timing`, `retries` and `stations` and resolves the timing of every station. The
/// line's serial format has been read already.
void load_stations(Loading& loading, yaml::MapReader& in, LineInWork work);

/// Of a line that is only listened to: a key that only requests of ours would need.
void warn_of_idle_key(Loading& loading, yaml::MapReader& in, std::string_view key);

/// A template that no station names, as the body of a station of any line: what is wrong with it
/// would be found by whoever uses it. One without a profile is held against the profile that it
/// fits best.
void judge_template(Loading& loading, const yaml::Node& body);

/// Warns of what the queue's deadline makes impossible, once of each cause: a response timeout, or
/// a read on this wire, that ends behind it. `node` is the whole line's.
void warn_of_deadline(Loading& loading, const yaml::Node& node, const Line& line);

/// `poll` and `points` of a station.
void load_points(Loading& loading, yaml::MapReader& in, Station& station);
/// The item that a required key names in the panel's notation.
std::optional<profile::Item> load_notation(yaml::MapReader& in, std::string_view key,
                                           const profile::PanelProfile& profile);
/// A problem at `key` when the panel does not give so many items in one read.
void check_read_count(yaml::MapReader& in, std::string_view key,
                      const profile::PanelProfile& profile, modbus::Table table,
                      std::uint32_t count);

}  // namespace panelgate::config
