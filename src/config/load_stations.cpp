#include "load_stations.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/yaml/document.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using arbiter::StationSettings;
using profile::allows;
using profile::PanelProfile;
using yaml::MapReader;
using yaml::Node;

template <class T, class Format>
std::string join(const std::vector<T>& values, const Format& format) {
    std::string list;
    for (const T& value : values) list += (list.empty() ? "" : ", ") + format(value);
    return list;
}

/// Checks the line's serial format against the panel's settings. Manuals describe RTU only.
void check_serial(MapReader& in, const LineContext& work, const PanelProfile& profile) {
    if (!work.serial_known || work.line.device.serial.mode == SerialMode::ascii) return;
    const profile::Serial& serial = profile.serial;
    const SerialFormat& format = work.line.device.serial;
    const std::string source = " (" + profile.manual + ", " + serial.source + ')';
    const auto number = [](int value) { return std::to_string(value); };
    const auto word = [](Parity parity) { return to_string(parity); };
    const auto refuse = [&](std::string_view key, const std::string& allowed,
                            const std::string& value) {
        in.problem("profile", profile.name + " allows " + std::string(key) + ' ' + allowed +
                                  ", not the line's " + value + source);
    };
    if (!allows(serial.baud, format.baud))
        refuse("baud", join(serial.baud, number), number(format.baud));
    if (!allows(serial.parity, format.parity))
        refuse("parity", join(serial.parity, word), to_string(format.parity));
    if (!allows(serial.stop_bits, format.stop_bits))
        refuse("stop_bits", join(serial.stop_bits, number), number(format.stop_bits));
}

/// Returns `generic` and adds a problem if the profile is unknown.
const PanelProfile* load_profile_name(Loading& loading, MapReader& in) {
    const std::string name = in.text("profile").value_or("generic");
    const profile::Catalogue& catalogue = *loading.config.profiles;
    if (const PanelProfile* found = catalogue.find(name)) return found;
    std::vector<std::string_view> names;
    for (const auto& [known, profile] : catalogue.all()) names.push_back(known);
    const std::string hint = did_you_mean(name, names, "profiles");
    const bool is_far = hint.starts_with("; known");
    in.problem("profile", "there is no profile " + yaml::quote(name) + hint +
                              (is_far ? "; `panelgate profiles` says for which panels" : ""));
    return catalogue.find("generic");
}

/// Returns 0 and adds a problem if there is none.
std::uint8_t load_id(Loading& loading, MapReader& in) {
    const Node* node = in.child("id");
    const bool plain = node != nullptr && node->kind == Node::Kind::scalar && !node->is_text();
    const auto number = plain ? yaml::parse_integer(node->scalar) : std::nullopt;
    if (number && *number == 0) {  // serial line V1.02, 2.2
        in.problem("id", "id must be from 1 to 247, not 0: that is the broadcast");
        return 0;
    }
    const auto id = static_cast<std::uint8_t>(
        in.required_integer("id", 1, modbus::kMaxListedStation).value_or(0));
    if (id == 0) return id;
    if (id > modbus::kMaxStation)
        loading.warn(
            in.mark("id"),
            "id " + node->scalar +
                " is outside the standard's 1 to 247: some devices have it (Temco, SIN-8), "
                "others answer it whatever their own is (PZEM 248, soil sensors 255); "
                "give the device one from 1 to 247 if it can have that");
    const std::string on = std::to_string(loading.config.lines.size());  // this line's index
    loading.firsts.once(in, "id", "id " + on + '/' + node->scalar,
                        "there are two stations " + node->scalar + " on this line");
    return id;
}

std::string load_station_name(Loading& loading, MapReader& in, const Line& line, std::uint8_t id) {
    const std::string number = std::to_string(id);
    std::string automatic = line.name + '-' + number;
    if (!in.has("name")) {
        if (id == 0 || line.name.empty()) return automatic;
        loading.station_names.insert(automatic);
        loading.firsts.once(in, "name", "station " + automatic,
                            "there is a station '" + automatic + "' already; give this a name");
        return automatic;
    }
    const std::string reserved = std::string(kAllStations) + '|' + std::string(kOtherStations);
    const auto name = load_name(in, false, "^(?!(?:" + reserved + ")$)" + name_pattern().substr(1));
    if (!name) return automatic;
    if (*name == kAllStations || *name == kOtherStations) {
        in.problem("name", "name must not be '" + *name +
                               "': metrics and findings call by it what has no name of its own");
        return automatic;
    }
    loading.station_names.insert(*name);
    loading.firsts.once(in, "name", "station " + *name,
                        "there are two stations '" + *name + "'; names are unique over all lines");
    if (yaml::parse_integer(*name) && *name != number) {
        in.problem("name", "name '" + *name + "' would be taken for a station id");
    }
    return *name;
}

/// Returns the items that every read of these functions may have: the panel's limit within the
/// standard's.
std::uint16_t read_limit(const PanelProfile& profile, std::initializer_list<std::uint8_t> functions,
                         unsigned standard) {
    unsigned limit = standard;
    for (const std::uint8_t function : functions) {
        if (profile.find_function(function) != nullptr)
            limit = std::min(limit, profile.max_count(function));
    }
    return static_cast<std::uint16_t>(limit);
}

void check_range(MapReader& in, const PanelProfile& profile, std::uint8_t id) {
    if (id == 0 || (id >= profile.first_station && id <= profile.last_station)) return;
    if (id > modbus::kMaxStation && profile.name == "generic") return;  // load_id() has warned
    in.problem("id", "id must be from " + std::to_string(profile.first_station) + " to " +
                         std::to_string(profile.last_station) + " for " + profile.name + ", not " +
                         std::to_string(id) + " (" + profile.manual + ')');
}

/// Warns of keys that only the gateway's own requests use.
void warn_of_unused_keys(Loading& loading, MapReader& in, const StationSettings& settings,
                         const Station& station) {
    const auto warn = [&](std::string_view key, bool is_set) {
        if (is_set && in.has(key)) warn_of_unused_key(loading, in, key);
    };
    warn("retries", true);
    warn("retry_writes", settings.retry_writes);
    warn("max_age", settings.max_age > Duration::zero());
    warn("guard", station.guard);
    warn("translate", !station.translate);
    if (settings.any_length)
        loading.warn(in.mark("any_length"),
                     "any_length does nothing on a line that is only listened to (mode: listen): "
                     "no client reads through the gateway there; leave it out");
}

/// Reads what a template may have: all but id, name and profile, which `station` has.
StationSettings load_body(Loading& loading, MapReader& in, const LineContext& work,
                          Station& station) {
    station.read_only = load_read_only(in).value_or(false);
    station.listens = work.line.listens;
    StationSettings settings = load_station_timing(loading, in, work, station);
    settings.id = station.id;
    settings.crc_order = station.profile->crc_order;
    StationBody body{station, settings};
    station_keys().read(in, body);
    if (work.line.device.serial.mode == SerialMode::ascii) {
        settings.crc_order = modbus::CrcOrder::low_first;
        if (in.has("crc_order"))
            in.problem("crc_order", "ASCII has no CRC, and one order of its LRC; leave it out");
        if (station.profile->crc_order != modbus::CrcOrder::low_first)
            loading.warn(in.mark("profile"),
                         "profile " + station.profile->name +
                             " differs in the order of the CRC's bytes, and ASCII has no CRC: take "
                             "the profile of the newer panel");
    }
    using namespace modbus;
    settings.max_registers =
        read_limit(*station.profile, {kReadHoldingRegisters, kReadInputRegisters}, 125);
    settings.max_bits = read_limit(*station.profile, {kReadCoils, kReadDiscreteInputs}, 2000);
    settings.vouched = station.profile->name != "generic";  // generic only repeats the standard
    load_map(in, "simulate", "{dead: true}",
             [&](MapReader& faults) { fault_keys().read(faults, station.faults); });
    load_points(loading, in, station);
    in.finish();
    if (station.listens) warn_of_unused_keys(loading, in, settings, station);
    return settings;
}

/// Keys that users write beside `id`.
constexpr std::array<yaml::Elsewhere, 13> kStationKeysElsewhere{
    {{"response_timeout", "timing", {}},
     {"frame_gap", "timing", {}},
     {"late_window", "timing", {}},
     {"station_gap", "timing", {}},
     {"after_write", "timing", {}},
     {"connect_pause", {}, "a line: all stations share its connection"},
     {"think_time", "timing", {}},
     {"serial", {}, "a line: all stations of a line share it"},
     {"baud", {}, "a line's serial"},
     {"parity", {}, "a line's serial"},
     {"device", {}, "a line"},
     {"echo", {}, "a line"},
     {"at", {}, "a point"}}};

Station load_station(Loading& loading, const Node& node, const LineContext& work) {
    MapReader in(node, loading.problems, "a station", "{id: 31, name: press}");
    in.elsewhere(kStationKeysElsewhere);
    in.has("template");  // known, though apply_templates() has removed it
    Station station;
    station.id = load_id(loading, in);
    station.name = load_station_name(loading, in, work.line, station.id);
    station.profile = load_profile_name(loading, in);
    check_range(in, *station.profile, station.id);
    check_serial(in, work, *station.profile);
    work.line.arbiter.stations.push_back(load_body(loading, in, work, station));
    return station;
}

/// Returns the problems of a template's body with this profile; nullptr: with the one it names.
yaml::Problems faults_of(Loading& loading, const Node& body, const PanelProfile* profile) {
    yaml::Problems faults(loading.problems.file());
    Config config;
    config.profiles = loading.config.profiles;
    Loading alone{loading.files, faults, config, {}, false};
    Line line;
    MapReader in(body, faults, "a station");
    Station station;
    station.id = 1;
    station.name = "template";
    in.has("profile");
    station.profile = profile == nullptr ? load_profile_name(alone, in) : profile;
    load_body(alone, in, {line, false, {}}, station);
    return faults;
}

bool needs_8n1(const Station& station) {
    const profile::Serial& serial = station.profile->serial;
    return serial.parity == std::vector{Parity::none} && !allows(serial.stop_bits, 2);
}

/// RTU characters have 11 bits, those of ASCII 10 (serial line V1.02, 2.5.1, 2.5.2).
void warn_of_character(Loading& loading, MapReader& in, const LineContext& work) {
    const SerialFormat& format = work.line.device.serial;
    const bool ascii = format.mode == SerialMode::ascii;
    const int right = ascii ? 10 : 11;
    if (!work.serial_known || format.bits_per_character() == right) return;
    if (ascii && format.data_bits == 8) return;  // as some panels require
    const bool needed = std::ranges::any_of(work.line.stations, needs_8n1);
    if (format.bits_per_character() == 10 && needed) return;
    const bool common = !ascii && format.bits_per_character() == 10;
    loading.warn(in.mark("serial"), to_string(format) + " is outside the Modbus specification (" +
                                        std::to_string(format.bits_per_character()) +
                                        "-bit characters instead of " + std::to_string(right) +
                                        ')' + (common ? " but common" : ""));
}

/// One frame cannot have both orders (arbiter::crc_orders()).
void warn_of_broadcasts(Loading& loading, MapReader& in, const Line& line) {
    const auto is_old = [](const StationSettings& station) {
        return station.crc_order == modbus::CrcOrder::high_first;
    };
    const auto old = std::ranges::find_if(line.arbiter.stations, is_old);
    if (old == line.arbiter.stations.end() || std::ranges::all_of(line.arbiter.stations, is_old))
        return;
    loading.warn(in.mark("stations"),
                 "broadcasts go out with the CRC's low byte first: those with crc_order "
                 "high_first, such as station " +
                     std::to_string(old->id) + ", do not hear them");
}

}  // namespace

void warn_of_unused_key(Loading& loading, MapReader& in, std::string_view key) {
    loading.warn(in.mark(key), std::string(key) +
                                   " does nothing on a line that is only listened to (mode: "
                                   "listen): nothing is sent there; leave it out");
}

void check_template(Loading& loading, const Node& body) {
    const bool named = body.find("profile") != nullptr;
    yaml::Problems least = faults_of(loading, body, nullptr);
    for (const auto& [name, profile] : loading.config.profiles->all()) {
        if (named || least.empty()) break;
        yaml::Problems faults = faults_of(loading, body, &profile);
        if (faults.list().size() < least.list().size()) least = std::move(faults);
    }
    loading.problems.take(least);
}

namespace {

bool is_adaptive(const StationSettings& settings) { return settings.adaptive_timeout; }

void warn_of_bound(Loading& loading, yaml::Mark mark) {
    loading.warn(mark,
                 "adaptive_floor and adaptive_ceiling do nothing without response_timeout: "
                 "adaptive; write that, or leave them out");
}

}  // namespace

void load_stations(Loading& loading, MapReader& in, LineContext work) {
    load_line_timing(loading, in, work);
    StationSettings& settings = work.timing.settings;
    settings.retries = static_cast<int>(in.integer("retries", 0, 10).value_or(settings.retries));
    work.line.arbiter.unlisted = settings;
    if (const Node* list = in.sequence("stations", "[{id: 31, name: press}]")) {
        for (const Node& node : list->items)
            work.line.stations.push_back(load_station(loading, node, work));
    } else if (in.child("stations") != nullptr) {
        loading.names_missing = true;
    }
    const bool adapts = std::ranges::any_of(work.line.arbiter.stations, is_adaptive);
    if (work.timing.unused_bound && !adapts) warn_of_bound(loading, *work.timing.unused_bound);
    warn_of_character(loading, in, work);
    warn_of_broadcasts(loading, in, work.line);
}

namespace {

std::string at_least(Duration duration) {
    return yaml::format_duration(std::chrono::ceil<std::chrono::microseconds>(duration));
}

void load_response_timeout(MapReader& in, Timing& timing) {
    StationSettings& settings = timing.settings;
    constexpr std::string_view kKey = "response_timeout";
    if (in.is_word(kKey, "adaptive")) {
        settings.adaptive_timeout = true;  // up to the line's own, or the default
    } else if (const auto timeout = in.duration(kKey, 1ms, 2min)) {
        settings.response_timeout = *timeout;
        settings.adaptive_timeout = false;
    }
    const auto ceiling = in.duration("adaptive_ceiling", 1ms, 2min);
    timing.unused_bound.reset();
    for (const std::string_view bound : {"adaptive_floor", "adaptive_ceiling"})
        if (!settings.adaptive_timeout && in.has(bound)) timing.unused_bound = in.mark(bound);
    if (!settings.adaptive_timeout) return;
    settings.response_timeout = ceiling.value_or(settings.response_timeout);
    if (settings.timeout_floor > settings.response_timeout) {
        in.problem(in.has("adaptive_floor") ? "adaptive_floor" : "adaptive_ceiling",
                   "adaptive_floor " + yaml::format_duration(settings.timeout_floor) +
                       " is above the adaptive_ceiling " +
                       yaml::format_duration(settings.response_timeout));
    }
}

/// Returns 3.5 characters at any rate: this separates frames for a panel that counts character
/// times. The standard's 1.75 ms above 19200 bit/s only avoids short timers (serial line V1.02,
/// 2.5.1.1). ASCII needs no gap to separate frames.
Duration shortest_gap(const SerialFormat& serial) { return wire_time(serial, 7) / 2; }

/// A line without a serial device here may have any gap.
void check_shortest_gap(MapReader& in, const LineContext& work, Duration gap) {
    const SerialFormat& serial = work.line.device.serial;
    const bool free = work.line.kind != Line::Kind::serial || !work.serial_known ||
                      serial.mode == SerialMode::ascii;
    if (free || gap >= shortest_gap(serial)) return;
    in.problem("frame_gap", "frame_gap must be at least " + at_least(shortest_gap(serial)) +
                                " (3.5 characters at " + to_string(serial) + "), not " +
                                yaml::format_duration(gap));
}

void warn_of_gap(Loading& loading, yaml::Mark mark, Duration gap, Duration asked,
                 const std::string& who) {
    loading.warn(mark, "frame_gap " + yaml::format_duration(gap) + " is less than the " +
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
    if (line.kind == Line::Kind::tcp) return 700ms;
    return 60ms + wire_time(line.device.serial, kChunk);
}

void load_reply_hole(MapReader& in, Line& line) {
    if (in.is_word("reply_hole", "auto")) return;
    const auto hole = in.duration("reply_hole", 1ms, 10s);
    line.arbiter.learns_holes = !hole;
    line.arbiter.reply_hole = hole.value_or(line.arbiter.reply_hole);
}

/// Reads the keys that lines and stations share.
void load_common(Loading& loading, MapReader& in, const LineContext& work, Timing& timing,
                 Otherwise otherwise) {
    const Given given = timing_keys().read(in, timing, otherwise);
    load_response_timeout(in, timing);
    if (given.has("frame_gap") && timing.frame_gap) check_shortest_gap(in, work, *timing.frame_gap);
    if (given.has("late_window") && timing.settings.late_window == Duration::zero())
        loading.warn(in.mark("late_window"),
                     "late_window: 0ms expects no late reply: one that comes all the same may "
                     "pass for the answer to the next request; write auto, or how late replies "
                     "come, such as 500ms");
}

}  // namespace

void load_line_timing(Loading& loading, MapReader& in, LineContext& work) {
    const SerialFormat& serial = work.line.device.serial;
    work.line.arbiter.reply_hole = automatic_hole(work.line);
    if (const Node* node = in.map("timing", "{response_timeout: 500ms}")) {
        MapReader timing(*node, loading.problems, "timing");
        load_common(loading, timing, work, work.timing, Otherwise::initial);
        load_reply_hole(timing, work.line);
        line_timing_keys().read(timing, work.line);
        timing.finish();
        work.line.think_time = work.timing.think_time;
        const Duration gap = work.timing.frame_gap.value_or(silent_interval(serial));
        const bool free = !work.serial_known || serial.mode == SerialMode::ascii;
        if (!free && gap < silent_interval(serial))
            warn_of_gap(loading, timing.mark("frame_gap"), gap, silent_interval(serial),
                        standard(serial));
    }
    StationSettings& settings = work.timing.settings;
    work.line.automatic_gap = !work.timing.frame_gap;
    settings.frame_gap = work.timing.frame_gap.value_or(silent_interval(serial));
}

StationSettings load_station_timing(Loading& loading, MapReader& in, const LineContext& work,
                                    Station& station) {
    Timing timing = work.timing;
    std::optional<yaml::Mark> own_gap;
    if (const Node* node = in.map("timing", "{response_timeout: 500ms}")) {
        MapReader own(*node, loading.problems, "a station's timing");
        load_common(loading, own, work, timing, Otherwise::owner);
        if (own.has("frame_gap")) own_gap = own.mark("frame_gap");
        const auto refuse = [&](std::string_view key, const std::string& why) {
            if (own.has(key))
                own.problem(key, std::string(key) + " belongs to the line's timing: " + why);
        };
        refuse("broadcast_turnaround", "a broadcast goes to every station");
        refuse("reply_hole", "the adapter or the network makes the holes, not a panel");
        own.finish();
        if (timing.unused_bound) warn_of_bound(loading, *timing.unused_bound);
    }
    station.think_time = timing.think_time;
    check_gap(loading, work, station, timing, own_gap, in.mark("timing"));
    station.automatic_gap = !timing.frame_gap;
    timing.settings.frame_gap = timing.frame_gap.value_or(
        profile::automatic_gap(work.line.device.serial, *station.profile));
    return timing.settings;
}

}  // namespace panelgate::config
