// The keys of `timing`: rows, and what they mean for a line and for its stations.

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using arbiter::StationSettings;
using yaml::format_duration;
using yaml::Node;

constexpr std::string_view kExample = "{response_timeout: 500ms}";

/// 500ms, or adaptive: up to adaptive_ceiling.
bool read_timeout(Reader& in, Timing& timing) {
    if (in.is_word("response_timeout", "adaptive")) return timing.settings.adaptive_timeout = true;
    const auto timeout = in.duration("response_timeout", 1ms, 2min);
    if (!timeout) return false;
    timing.settings.response_timeout = *timeout;
    timing.settings.adaptive_timeout = false;
    return true;
}

Line& line_of(LineContext& work) { return work.line; }
const Line& line_of(const Line& line) { return line; }

/// The timing of a line, while it is read and when it is shown.
struct TimingOf {
    Timing& operator()(LineContext& work) const { return work.timing; }
    Timing operator()(const Line& line) const {
        return written(line.arbiter.unlisted, line.automatic_gap, line.think_time);
    }
};

}  // namespace

Timing written(const StationSettings& settings, bool automatic_gap, Duration think_time) {
    return {settings, automatic_gap ? std::nullopt : settings.frame_gap, think_time};
}

const Keys<Timing>& timing_keys() {
    const auto is_adaptive = [](const Timing& timing) { return timing.settings.adaptive_timeout; };
    KeyShape timeout = durations("response_timeout", 1ms, 2min,
                                 "Longest time from the end of a request on the wire to the first "
                                 "byte of its reply; adaptive: as the panel has needed it lately.");
    timeout.words = {"adaptive"};
    static const auto kKeys =
        Keys<Timing>()
            .value(timeout, read_timeout,
                   [=](const Timing& of) {
                       return is_adaptive(of) ? "adaptive"
                                              : format_duration(of.settings.response_timeout);
                   })
            .duration(
                "adaptive_floor", [](auto& of) -> auto& { return of.settings.timeout_floor; }, 1ms,
                10s, "Shortest timeout, of response_timeout: adaptive.")
            .shown_if(is_adaptive)
            .duration("adaptive_ceiling", &Timing::ceiling, 1ms, 2min,
                      "Longest timeout, of response_timeout: adaptive; not below adaptive_floor. "
                      "Without it the line's timeout, or 500ms.")
            .shown_as([=](const Timing& of) {
                return is_adaptive(of) ? format_duration(of.settings.response_timeout) : "";
            })
            .duration_or_auto("frame_gap", &Timing::frame_gap, 0ms, 10s,
                              "Silence between two frames; auto: 3.5 characters (1.75 ms above "
                              "19200 baud), or what the profile asks. Shorter than 3.5 characters "
                              "only on sim, on tcp:// and in ASCII.")
            .duration_or_auto(
                "late_window", [](auto& of) -> auto& { return of.settings.late_window; }, 0ms,
                10min,
                "How long after a timeout a late reply may still come; auto: as has been seen of "
                "the station.")
            .duration(
                "station_gap", [](auto& of) -> auto& { return of.settings.station_gap; }, 0ms, 10s,
                "Least time between a reply of a station and the next request to it; other "
                "stations are asked meanwhile.")
            .duration(
                "after_write", [](auto& of) -> auto& { return of.settings.after_write; }, 0ms, 1min,
                "Least time between a station's answer to a write and the next request to it, "
                "where longer than station_gap.")
            .duration("think_time", &Timing::think_time, 0ms, 10s,
                      "Think time of a panel that the plan of `check` assumes.");
    return kKeys;
}

const Keys<LineContext, Line>& line_timing_keys() {
    KeyShape hole = durations("reply_hole", 1ms, 10s,
                              "Longest silence inside a reply; auto: 60 ms and 32 characters, on "
                              "tcp:// 700 ms, in ASCII 1 s, longer for a station that pauses so.");
    hole.words = {"auto"};
    static const auto kKeys =
        Keys<LineContext, Line>()
            .with(timing_keys(), TimingOf{})
            .value(
                hole,
                [](Reader& in, LineContext& work) {
                    if (in.is_word("reply_hole", "auto")) return true;
                    const auto typed = in.duration("reply_hole", 1ms, 10s);
                    work.line.arbiter.learns_holes = !typed;
                    work.line.arbiter.reply_hole = typed.value_or(work.line.arbiter.reply_hole);
                    return typed.has_value();
                },
                [](const Line& line) {
                    return line.arbiter.learns_holes ? "auto"
                                                     : format_duration(line.arbiter.reply_hole);
                })
            .initially("auto")
            .example("60ms")
            .duration(
                "broadcast_turnaround",
                [](auto& of) -> auto& { return line_of(of).arbiter.broadcast_turnaround; }, 1ms,
                1min, "Pause after a broadcast, in which the panels execute it.");
    return kKeys;
}

namespace {

std::string at_least(Duration duration) {
    return format_duration(std::chrono::ceil<std::chrono::microseconds>(duration));
}

void resolve_timeout(Reader& in, Timing& timing) {
    StationSettings& settings = timing.settings;
    timing.unused_bound.reset();
    for (const std::string_view bound : {"adaptive_floor", "adaptive_ceiling"})
        if (!settings.adaptive_timeout && in.has(bound)) timing.unused_bound = in.mark(bound);
    const std::optional<Duration> ceiling = std::exchange(timing.ceiling, std::nullopt);
    if (!settings.adaptive_timeout) return;
    settings.response_timeout = ceiling.value_or(settings.response_timeout);
    if (settings.timeout_floor > settings.response_timeout)
        in.problem(in.has("adaptive_floor") ? "adaptive_floor" : "adaptive_ceiling",
                   "adaptive_floor " + format_duration(settings.timeout_floor) +
                       " is above the adaptive_ceiling " +
                       format_duration(settings.response_timeout));
}

/// Returns 3.5 characters at any rate: this separates frames for a panel that counts character
/// times. The standard's 1.75 ms above 19200 bit/s only avoids short timers (serial line V1.02,
/// 2.5.1.1). ASCII needs no gap to separate frames.
Duration shortest_gap(const SerialFormat& serial) { return wire_time(serial, 7) / 2; }

/// A line without a serial device here may have any gap.
void check_shortest_gap(Reader& in, const LineContext& work, Duration gap) {
    const SerialFormat& serial = work.line.device.serial;
    const bool free = work.line.kind != Line::Kind::serial || !work.serial_known ||
                      serial.mode == SerialMode::ascii;
    if (free || gap >= shortest_gap(serial)) return;
    in.problem("frame_gap", "frame_gap must be at least " + at_least(shortest_gap(serial)) +
                                " (3.5 characters at " + to_string(serial) + "), not " +
                                format_duration(gap));
}

void warn_of_gap(Loading& loading, yaml::Mark mark, Duration gap, Duration asked,
                 const std::string& who) {
    loading.warn(mark, "frame_gap " + format_duration(gap) + " is less than the " +
                           at_least(asked) + " that " + who);
}

std::string standard(const SerialFormat& serial) {
    return "the standard asks for (t3.5 at " + to_string(serial) + ")";
}

/// True if an inherited gap needs no warning of its own: the panel asks for no more than the
/// standard, or a station with this profile and gap was warned already.
bool was_warned(const LineContext& work, const Station& station, Duration gap, Duration asked) {
    if (asked <= silent_interval(work.line.device.serial)) return true;
    for (std::size_t i = 0; i < work.line.stations.size(); ++i) {
        const bool alike = work.line.stations[i].profile == station.profile;
        if (alike && work.line.arbiter.stations[i].frame_gap == gap) return true;
    }
    return false;
}

/// `timing` is the station's, merged over the line's; `own` is where the station itself sets the
/// gap.
void check_gap(Loading& loading, const LineContext& work, const Station& station,
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

/// Returns the longest pause inside a reply on a healthy transport. A tty: a USB latency timer (16
/// ms), a busy machine, and one chunk of an adapter's FIFO, delivered as a whole: at low rates that
/// alone is longer. TCP: a segment lost twice; the first retransmission comes after at least 200
/// ms, the second after twice as long (RFC 6298, 5.5; Linux). In ASCII the panel may also pause for
/// a second (serial line V1.02, 2.5.2.1).
Duration automatic_hole(const Line& line) {
    constexpr std::size_t kChunk = 32;
    if (line.device.serial.mode == SerialMode::ascii) return 1s;
    if (line.device.modbus_tcp) return 10ms;
    if (line.kind == Line::Kind::tcp) return 700ms;
    return 60ms + wire_time(line.device.serial, kChunk);
}

/// What lines and stations have in common.
void check_common(Reader& in, const LineContext& work, Timing& timing, const Given& given) {
    resolve_timeout(in, timing);
    if (given.has("frame_gap") && timing.frame_gap) check_shortest_gap(in, work, *timing.frame_gap);
    if (in.has("frame_gap") && work.line.device.modbus_tcp)
        in.problem("frame_gap",
                   "frame_gap belongs to a serial line: modbus-tcp:// has none; for a pause behind "
                   "each reply write station_gap");
    if (given.has("late_window") && timing.settings.late_window == Duration::zero())
        in.warn("late_window",
                "late_window: 0ms expects no late reply: one that comes all the same may pass for "
                "the answer to the next request; write auto, or how late replies come, such as "
                "500ms");
}

void warn_of_bound(Loading& loading, yaml::Mark mark) {
    loading.warn(mark,
                 "adaptive_floor and adaptive_ceiling do nothing without response_timeout: "
                 "adaptive; write that, or leave them out");
}

/// RTU characters have 11 bits, those of ASCII 10 (serial line V1.02, 2.5.1, 2.5.2).
void warn_of_character(Reader& in, const LineContext& work) {
    const SerialFormat& format = work.line.device.serial;
    const bool ascii = format.mode == SerialMode::ascii;
    const int right = ascii ? 10 : 11;
    if (!work.serial_known || format.bits_per_character() == right) return;
    if (ascii && format.data_bits == 8) return;  // as some panels require
    const bool needed = std::ranges::any_of(work.line.stations, [](const Station& station) {
        const profile::Serial& serial = station.profile->serial;
        return serial.parity == std::vector{Parity::none} && !profile::allows(serial.stop_bits, 2);
    });
    if (format.bits_per_character() == 10 && needed) return;
    const bool common = !ascii && format.bits_per_character() == 10;
    in.warn("serial", to_string(format) + " is outside the Modbus specification (" +
                          std::to_string(format.bits_per_character()) +
                          "-bit characters instead of " + std::to_string(right) + ')' +
                          (common ? " but common" : ""));
}

/// One frame cannot have both orders (arbiter::crc_orders()).
void warn_of_broadcasts(Reader& in, const Line& line) {
    const auto is_old = [](const StationSettings& station) {
        return station.crc_order == modbus::CrcOrder::high_first;
    };
    const auto old = std::ranges::find_if(line.arbiter.stations, is_old);
    if (old == line.arbiter.stations.end() || std::ranges::all_of(line.arbiter.stations, is_old))
        return;
    in.warn("stations",
            "broadcasts go out with the CRC's low byte first: those with crc_order high_first, "
            "such as station " +
                std::to_string(old->id) + ", do not hear them");
}

}  // namespace

bool load_line_timing(Reader& in, LineContext& work) {
    const SerialFormat& serial = work.line.device.serial;
    work.line.arbiter.reply_hole = automatic_hole(work.line);
    // Modbus/TCP replies carry a transaction id: no gap and no late window before the next request.
    if (work.line.device.modbus_tcp) {
        work.timing.frame_gap = Duration::zero();
        work.timing.settings.late_window = Duration::zero();
    }
    const Node* node = in.map("timing", kExample);
    if (node != nullptr) {
        Reader own(in.loading, *node, "timing");
        check_common(own, work, work.timing, line_timing_keys().read(own, work));
        own.finish();
        work.line.think_time = work.timing.think_time;
        const Duration gap = work.timing.frame_gap.value_or(silent_interval(serial));
        const bool free = !work.serial_known || serial.mode == SerialMode::ascii;
        if (!free && gap < silent_interval(serial))
            warn_of_gap(in.loading, own.mark("frame_gap"), gap, silent_interval(serial),
                        standard(serial));
    }
    work.line.automatic_gap = !work.timing.frame_gap;
    work.timing.settings.frame_gap = work.timing.frame_gap.value_or(silent_interval(serial));
    return node != nullptr;
}

StationSettings load_station_timing(Reader& in, const LineContext& work, Station& station) {
    Timing timing = work.timing;
    std::optional<yaml::Mark> own_gap;
    if (const Node* node = in.map("timing", kExample)) {
        Reader own(in.loading, *node, "a station's timing");
        check_common(own, work, timing, timing_keys().read(own, timing));
        if (own.has("frame_gap")) own_gap = own.mark("frame_gap");
        own.refuse("broadcast_turnaround",
                   "belongs to the line's timing: a broadcast goes to every station");
        own.refuse("reply_hole",
                   "belongs to the line's timing: the adapter or the network makes the holes, not "
                   "a panel");
        own.finish();
        if (timing.unused_bound) warn_of_bound(in.loading, *timing.unused_bound);
    }
    station.think_time = timing.think_time;
    check_gap(in.loading, work, station, timing, own_gap, in.mark("timing"));
    station.automatic_gap = !timing.frame_gap;
    timing.settings.frame_gap = timing.frame_gap.value_or(
        profile::automatic_gap(work.line.device.serial, *station.profile));
    return timing.settings;
}

void warn_of_stations(Reader& in, const LineContext& work) {
    const bool adapts =
        std::ranges::any_of(work.line.arbiter.stations, &StationSettings::adaptive_timeout);
    if (work.timing.unused_bound && !adapts) warn_of_bound(in.loading, *work.timing.unused_bound);
    warn_of_character(in, work);
    warn_of_broadcasts(in, work.line);
}

}  // namespace panelgate::config
