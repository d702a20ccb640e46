#include <algorithm>
#include <chrono>

#include "load_stations.hpp"
#include "panelgate/base/serial_format.hpp"

namespace panelgate::config {
namespace {

using arbiter::StationSettings;
using yaml::MapReader;
using yaml::Node;

bool is_word(MapReader& in, std::string_view key, std::string_view word) {
    const Node* node = in.child(key);
    return node != nullptr && node->kind == Node::Kind::scalar && node->scalar == word;
}

std::string at_least(Duration duration) {
    return yaml::format_duration(std::chrono::ceil<std::chrono::microseconds>(duration));
}

void load_response_timeout(MapReader& in, StationSettings& settings) {
    constexpr std::string_view kKey = "response_timeout";
    if (is_word(in, kKey, "adaptive")) {
        settings.adaptive_timeout = true;  // up to the line's own, or the default
    } else if (const auto timeout = in.duration(kKey, 1ms, 2min)) {
        settings.response_timeout = *timeout;
        settings.adaptive_timeout = false;
    }
    Duration& floor = settings.timeout_floor;
    floor = in.duration("adaptive_floor", 1ms, 10s).value_or(floor);
    const auto ceiling = in.duration("adaptive_ceiling", 1ms, 2min);
    if (!settings.adaptive_timeout) return;
    settings.response_timeout = ceiling.value_or(settings.response_timeout);
    if (floor > settings.response_timeout) {
        in.problem(in.has("adaptive_floor") ? "adaptive_floor" : "adaptive_ceiling",
                   "adaptive_floor " + yaml::format_duration(floor) +
                       " is above the adaptive_ceiling " +
                       yaml::format_duration(settings.response_timeout));
    }
}

/// Nothing = auto. Less than the standard's silence is refused: the standard has no shorter frame
/// gap (serial line V1.02, 2.5.1.1).
void load_frame_gap(MapReader& in, const LineInWork& work, Timing& timing) {
    if (is_word(in, "frame_gap", "auto")) {
        timing.frame_gap.reset();
        return;
    }
    const auto gap = in.duration("frame_gap", 0ms, 10s);
    if (!gap) return;
    timing.frame_gap = gap;
    const SerialFormat& serial = work.line.device.serial;
    if (!work.serial_known || *gap >= silent_interval(serial)) return;
    in.problem("frame_gap", "frame_gap must be at least " + at_least(silent_interval(serial)) +
                                " (t3.5 at " + to_string(serial) + "), not " +
                                yaml::format_duration(*gap));
}

void load_late_window(MapReader& in, StationSettings& settings) {
    if (is_word(in, "late_window", "auto")) {
        settings.late_window.reset();
    } else if (const auto window = in.duration("late_window", 0ms, 10min)) {
        settings.late_window = window;
    }
}

/// The keys that a line and a station have.
void load_common(MapReader& in, const LineInWork& work, Timing& timing) {
    load_response_timeout(in, timing.settings);
    load_frame_gap(in, work, timing);
    load_late_window(in, timing.settings);
    in.duration("think_time", 0ms, 10s);  // what the plan assumes of a panel; nothing waits for it
}

}  // namespace

void load_line_timing(Loading& loading, MapReader& in, LineInWork& work) {
    if (const Node* node = in.map("timing")) {
        MapReader timing(*node, loading.problems, "timing");
        load_common(timing, work, work.timing);
        Duration& turnaround = work.line.arbiter.broadcast_turnaround;
        turnaround = timing.duration("broadcast_turnaround", 1ms, 1min).value_or(turnaround);
        timing.finish();
    }
    StationSettings& settings = work.timing.settings;
    settings.frame_gap = work.timing.frame_gap.value_or(silent_interval(work.line.device.serial));
}

StationSettings load_station_timing(Loading& loading, MapReader& in, const LineInWork& work,
                                    const Station& station) {
    Timing timing = work.timing;
    const Node* node = in.map("timing");
    if (node != nullptr) {
        MapReader own(*node, loading.problems, "a station's timing");
        load_common(own, work, timing);
        if (own.has("broadcast_turnaround"))
            own.problem("broadcast_turnaround",
                        "broadcast_turnaround belongs to the line's timing: a broadcast goes to "
                        "every station");
        own.finish();
    }
    const SerialFormat& serial = work.line.device.serial;
    const double characters = station.profile->timing.frame_gap_characters;
    const auto asked = std::chrono::duration_cast<Duration>(characters * character_time(serial));
    const Duration automatic = std::max(silent_interval(serial), asked);
    const bool too_short = timing.frame_gap && *timing.frame_gap >= silent_interval(serial) &&
                           *timing.frame_gap < automatic;
    if (work.serial_known && too_short) {
        loading.warn(in.mark("timing"), "frame_gap " + yaml::format_duration(*timing.frame_gap) +
                                            " is less than the " + at_least(automatic) + " that " +
                                            station.profile->name + " asks for");
    }
    timing.settings.frame_gap = timing.frame_gap.value_or(automatic);
    return timing.settings;
}

}  // namespace panelgate::config
