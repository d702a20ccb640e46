#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "load_stations.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/profile/frame_gap.hpp"

namespace panelgate::config {
namespace {

using arbiter::StationSettings;
using yaml::MapReader;
using yaml::Node;

std::string at_least(Duration duration) {
    return yaml::format_duration(std::chrono::ceil<std::chrono::microseconds>(duration));
}

void load_response_timeout(MapReader& in, StationSettings& settings) {
    constexpr std::string_view kKey = "response_timeout";
    if (in.is_word(kKey, "adaptive")) {
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

/// 3.5 characters at any rate: what tells frames apart for a panel that counts its own characters.
/// The standard's 1.75 ms above 19200 bit/s only spare it short timers (serial line
/// V1.02, 2.5.1.1). ASCII tells them apart without any.
Duration shortest_gap(const SerialFormat& serial) { return wire_time(serial, 7) / 2; }

/// Nothing = auto. Where the wire does not begin at the gateway, any gap will do.
void load_frame_gap(MapReader& in, const LineInWork& work, Timing& timing) {
    if (in.is_word("frame_gap", "auto")) {
        timing.frame_gap.reset();
        return;
    }
    const auto gap = in.duration("frame_gap", 0ms, 10s);
    if (!gap) return;
    timing.frame_gap = gap;
    const SerialFormat& serial = work.line.device.serial;
    const bool free = work.line.kind != Line::Kind::serial || !work.serial_known ||
                      serial.mode == SerialMode::ascii;
    if (free || *gap >= shortest_gap(serial)) return;
    in.problem("frame_gap", "frame_gap must be at least " + at_least(shortest_gap(serial)) +
                                " (3.5 characters at " + to_string(serial) + "), not " +
                                yaml::format_duration(*gap));
}

void warn_of_gap(Loading& loading, yaml::Mark mark, Duration gap, Duration asked,
                 const std::string& who) {
    loading.warn(mark, "frame_gap " + yaml::format_duration(gap) + " is less than the " +
                           at_least(asked) + " that " + who);
}

std::string standard(const SerialFormat& serial) {
    return "the standard asks for (t3.5 at " + to_string(serial) + ")";
}

/// A panel that inherits its line's gap gets a warning of its own only when it asks for more than
/// the standard does, and only the first of its kind: the line's key has had one.
bool was_warned(const LineInWork& work, const Station& station, Duration gap, Duration asked) {
    if (asked <= silent_interval(work.line.device.serial)) return true;
    for (std::size_t i = 0; i < work.line.stations.size(); ++i) {
        const bool alike = work.line.stations[i].profile == station.profile;
        if (alike && work.line.arbiter.stations[i].frame_gap == gap) return true;
    }
    return false;
}

/// `timing` is the station's, its own keys already over the line's; `own` is where it says so
/// itself.
void check_gap(Loading& loading, const LineInWork& work, const Station& station,
               const Timing& timing, std::optional<yaml::Mark> own, yaml::Mark place) {
    const SerialFormat& serial = work.line.device.serial;
    const Duration asked = profile::asked_gap(serial, *station.profile);
    const Duration wanted = profile::automatic_gap(serial, *station.profile);
    const Duration gap = timing.frame_gap.value_or(wanted);
    if (!work.serial_known || gap >= wanted || serial.mode == SerialMode::ascii) return;
    if (!own && was_warned(work, station, gap, asked)) return;
    const bool by_panel = asked > silent_interval(serial);
    warn_of_gap(loading, own.value_or(place), gap, wanted,
                by_panel ? station.profile->name + " asks for" : standard(serial));
}

/// What no healthy way to the panels exceeds. A tty: a USB latency timer (16 ms), a busy machine,
/// and the time of one chunk of an adapter's FIFO, because its bytes are handed over together: at
/// low rates that alone is longer. TCP: a segment that is lost twice; the first retransmission
/// comes after 200 ms at least, the second after twice as long (RFC 6298, 5.5; Linux). In ASCII the
/// panel may pause besides, for a second (serial line V1.02, 2.5.2.1).
Duration automatic_hole(const Line& line) {
    constexpr std::size_t kChunk = 32;
    if (line.device.serial.mode == SerialMode::ascii) return 1s;
    if (line.kind == Line::Kind::tcp) return 700ms;
    return 60ms + wire_time(line.device.serial, kChunk);
}

void load_reply_hole(MapReader& in, Duration& hole) {
    if (in.is_word("reply_hole", "auto")) return;
    hole = in.duration("reply_hole", 1ms, 10s).value_or(hole);
}

void load_late_window(Loading& loading, MapReader& in, StationSettings& settings) {
    if (in.is_word("late_window", "auto")) {
        settings.late_window.reset();
    } else if (const auto window = in.duration("late_window", 0ms, 10min)) {
        settings.late_window = window;
        if (*window == Duration::zero())
            loading.warn(in.mark("late_window"),
                         "late_window: 0ms expects no late reply: one that comes all the same may "
                         "pass for the answer to the next request; write auto, or how late replies "
                         "come, such as 500ms");
    }
}

/// The keys that a line and a station have.
void load_common(Loading& loading, MapReader& in, const LineInWork& work, Timing& timing) {
    load_response_timeout(in, timing.settings);
    load_frame_gap(in, work, timing);
    load_late_window(loading, in, timing.settings);
    timing.think_time = in.duration("think_time", 0ms, 10s).value_or(timing.think_time);
}

}  // namespace

void load_line_timing(Loading& loading, MapReader& in, LineInWork& work) {
    const SerialFormat& serial = work.line.device.serial;
    work.line.arbiter.reply_hole = automatic_hole(work.line);
    if (const Node* node = in.map("timing", "{response_timeout: 500ms}")) {
        MapReader timing(*node, loading.problems, "timing");
        load_common(loading, timing, work, work.timing);
        load_reply_hole(timing, work.line.arbiter.reply_hole);
        Duration& turnaround = work.line.arbiter.broadcast_turnaround;
        turnaround = timing.duration("broadcast_turnaround", 1ms, 1min).value_or(turnaround);
        timing.finish();
        const Duration gap = work.timing.frame_gap.value_or(silent_interval(serial));
        const bool free = !work.serial_known || serial.mode == SerialMode::ascii;
        if (!free && gap < silent_interval(serial))
            warn_of_gap(loading, timing.mark("frame_gap"), gap, silent_interval(serial),
                        standard(serial));
    }
    StationSettings& settings = work.timing.settings;
    settings.frame_gap = work.timing.frame_gap.value_or(silent_interval(serial));
}

StationSettings load_station_timing(Loading& loading, MapReader& in, const LineInWork& work,
                                    Station& station) {
    Timing timing = work.timing;
    std::optional<yaml::Mark> own_gap;
    if (const Node* node = in.map("timing", "{response_timeout: 500ms}")) {
        MapReader own(*node, loading.problems, "a station's timing");
        load_common(loading, own, work, timing);
        if (own.has("frame_gap")) own_gap = own.mark("frame_gap");
        const auto refuse = [&](std::string_view key, const std::string& why) {
            if (own.has(key))
                own.problem(key, std::string(key) + " belongs to the line's timing: " + why);
        };
        refuse("broadcast_turnaround", "a broadcast goes to every station");
        refuse("reply_hole", "the adapter or the network makes the holes, not a panel");
        own.finish();
    }
    station.think_time = timing.think_time;
    check_gap(loading, work, station, timing, own_gap, in.mark("timing"));
    station.automatic_gap = !timing.frame_gap;
    timing.settings.frame_gap = timing.frame_gap.value_or(
        profile::automatic_gap(work.line.device.serial, *station.profile));
    return timing.settings;
}

}  // namespace panelgate::config
