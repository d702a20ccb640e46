#include "load_stations.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/suggest.hpp"

namespace panelgate::config {
namespace {

using arbiter::StationSettings;
using yaml::MapReader;
using yaml::Node;

/// Timing as written; frame_gap: nothing = auto.
struct Timing {
    StationSettings settings;
    std::optional<Duration> frame_gap;
};

bool is_word(MapReader& in, std::string_view key, std::string_view word) {
    const Node* node = in.child(key);
    return node != nullptr && node->kind == Node::Kind::scalar && node->scalar == word;
}

void load_timing(Loading& loading, MapReader& owner, const Line& line, Timing& timing,
                 bool of_station, Duration* turnaround) {
    const Node* node = owner.map("timing");
    if (node == nullptr) return;
    MapReader in(*node, loading.problems, of_station ? "a station's timing" : "timing");
    StationSettings& s = timing.settings;
    if (is_word(in, "response_timeout", "adaptive")) {
        in.problem(
            "response_timeout",
            "response_timeout: adaptive is not in this version; give a duration such as 500ms");
    } else {
        s.response_timeout =
            in.duration("response_timeout", 10ms, 120s).value_or(s.response_timeout);
    }
    if (is_word(in, "frame_gap", "auto")) {
        timing.frame_gap.reset();
    } else if (const auto gap = in.duration("frame_gap", 0ms, 10s)) {
        timing.frame_gap = gap;
        const Duration least = silent_interval(line.device.serial);
        if (*gap < least) {
            const auto us = std::chrono::ceil<std::chrono::microseconds>(least);
            in.problem("frame_gap", "frame_gap must be at least " + yaml::format_duration(us) +
                                        " (t3.5 at " + to_string(line.device.serial) + "), not " +
                                        yaml::format_duration(*gap));
        }
    }
    if (is_word(in, "late_window", "auto")) {
        s.late_window.reset();
    } else if (const auto window = in.duration("late_window", 0ms, 60s)) {
        s.late_window = window;
    }
    in.duration("think_time", 0ms, 10s);  // what the plan assumes of a panel
    if (turnaround != nullptr) {
        *turnaround = in.duration("broadcast_turnaround", 1ms, 60s).value_or(*turnaround);
    }
    in.finish();
}

template <class T, class Format>
void check_allowed(Loading& loading, const Station& station, yaml::Mark mark, std::string_view what,
                   const T& value, const std::vector<T>& allowed, const Format& format) {
    if (allowed.empty() || std::find(allowed.begin(), allowed.end(), value) != allowed.end())
        return;
    std::string list;
    for (const T& one : allowed) list += (list.empty() ? "" : ", ") + format(one);
    loading.problems.add(mark, "station '" + station.name + "' (" + station.profile->name +
                                   ") takes " + std::string(what) + ' ' + list + ", the line has " +
                                   format(value));
}

void check_serial(Loading& loading, const Line& line, const Station& station, yaml::Mark mark) {
    const profile::Serial& serial = station.profile->serial;
    const SerialFormat& format = line.device.serial;
    const auto number = [](int value) { return std::to_string(value); };
    const auto word = [](Parity p) {
        return std::string(p == Parity::none ? "none" : p == Parity::even ? "even" : "odd");
    };
    check_allowed(loading, station, mark, "baud", format.baud, serial.baud, number);
    check_allowed(loading, station, mark, "parity", format.parity, serial.parity, word);
    check_allowed(loading, station, mark, "stop_bits", format.stop_bits, serial.stop_bits, number);
}

const profile::PanelProfile* find_profile(Loading& loading, MapReader& in) {
    const std::string name = in.text("profile").value_or("generic");
    const profile::PanelProfile* found = loading.config.profiles->find(name);
    if (found != nullptr) return found;
    std::vector<std::string_view> names;
    std::string list;
    for (const auto& [known, profile] : loading.config.profiles->all()) {
        names.push_back(known);
        list += (list.empty() ? "" : ", ") + known;
    }
    const std::string near = nearest(name, names);
    in.problem("profile",
               "there is no profile '" + name + "'; " +
                   (near.empty() ? "known profiles are " + list : "did you mean '" + near + "'?"));
    return loading.config.profiles->find("generic");
}

/// id and name, unique where they have to be.
void load_identity(Loading& loading, MapReader& in, const Line& line, Station& station) {
    station.id =
        static_cast<std::uint8_t>(in.required_integer("id", 1, modbus::kMaxStation).value_or(0));
    const bool has_id = station.id != 0;
    for (const Station& other : line.stations) {
        if (has_id && other.id == station.id) {
            in.problem("id",
                       "line '" + line.name + "' has two stations " + std::to_string(station.id));
        }
    }
    station.name = in.text("name").value_or(line.name + '-' + std::to_string(station.id));
    if (!is_name(station.name)) {
        in.problem("name", "name must be of a-z, 0-9 and '-', not '" + station.name + '\'');
    } else if (has_id && !loading.station_names.insert(station.name).second) {
        in.problem("name", "there are two stations '" + station.name +
                               "'; names are unique over all lines");
    }
}

/// Keys of the contract whose feature this version does not have: never silently.
void load_later_keys(Loading& loading, MapReader& in) {
    if (in.boolean("guard").value_or(false)) {
        in.problem("guard", "guard: true is not in this version; remove it");
    }
    if (in.duration("max_age", 0ms, 24h).value_or(0ms) > 0ms) {
        loading.warn(in.mark("max_age"),
                     "max_age has no effect in this version: every read asks the panel");
    }
    for (const std::string_view key : {"poll", "points"}) {
        if (in.sequence(key) == nullptr) continue;
        loading.warn(in.mark(key),
                     std::string(key) + " has no effect in this version: nothing is polled");
    }
}

Station load_station(Loading& loading, const Node& node, Line& line, const Timing& of_line) {
    MapReader in(node, loading.problems, "a station");
    Station station;
    load_identity(loading, in, line, station);
    station.profile = find_profile(loading, in);
    const profile::PanelProfile& profile = *station.profile;
    if (station.id != 0 &&
        (station.id < profile.first_station || station.id > profile.last_station)) {
        in.problem("id", "id must be from " + std::to_string(profile.first_station) + " to " +
                             std::to_string(profile.last_station) + " for " + profile.name +
                             ", not " + std::to_string(station.id));
    }
    constexpr std::array<std::string_view, 2> kAccess{"read_write", "read_only"};
    station.read_only = in.choice_index("access", kAccess) == std::size_t{1};
    check_serial(loading, line, station, node.mark);

    Timing timing = of_line;
    load_timing(loading, in, line, timing, true, nullptr);
    StationSettings& settings = timing.settings;
    settings.id = station.id;
    settings.retries = static_cast<int>(in.integer("retries", 0, 10).value_or(settings.retries));
    settings.retry_writes = in.boolean("retry_writes").value_or(false);
    const auto asked = std::chrono::duration_cast<Duration>(profile.timing.frame_gap_characters *
                                                            character_time(line.device.serial));
    settings.frame_gap =
        timing.frame_gap.value_or(std::max(silent_interval(line.device.serial), asked));
    settings.max_registers = static_cast<std::uint16_t>(
        std::min(125u, profile.max_count(modbus::kReadHoldingRegisters)));
    settings.max_bits =
        static_cast<std::uint16_t>(std::min(2000u, profile.max_count(modbus::kReadCoils)));
    load_later_keys(loading, in);
    in.finish();
    line.arbiter.stations.push_back(settings);
    return station;
}

}  // namespace

void load_stations(Loading& loading, MapReader& in, Line& line) {
    Timing timing;
    load_timing(loading, in, line, timing, false, &line.arbiter.broadcast_turnaround);
    timing.settings.retries = static_cast<int>(in.integer("retries", 0, 10).value_or(1));
    timing.settings.frame_gap = timing.frame_gap.value_or(silent_interval(line.device.serial));
    line.arbiter.unlisted = timing.settings;
    if (const Node* list = in.sequence("stations")) {
        for (const Node& node : list->items) {
            line.stations.push_back(load_station(loading, node, line, timing));
        }
    }
    const SerialFormat& format = line.device.serial;
    const bool asked_for =
        std::any_of(line.stations.begin(), line.stations.end(), [](const Station& s) {
            return s.profile != nullptr && !s.profile->serial.stop_bits.empty();
        });
    if (format.bits_per_character() == 10 && !asked_for) {
        loading.warn(in.mark("serial"),
                     to_string(format) +
                         " is outside the Modbus specification (11-bit characters), though common");
    }
}

}  // namespace panelgate::config
