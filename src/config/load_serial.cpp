#include "load_serial.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hints.hpp"
#include "load_access.hpp"
#include "loader.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using yaml::MapReader;
using yaml::Node;

/// RTU has 8, ASCII normally 7, and 8 on some panels (serial line V1.02, 2.5.1, 2.5.2).
void load_data_bits(MapReader& in, SerialFormat& format) {
    const bool ascii = format.mode == SerialMode::ascii;
    const Node* typed = in.child("data_bits");
    const bool plain = typed != nullptr && typed->kind == Node::Kind::scalar && !typed->is_text();
    const auto number = plain ? yaml::parse_integer(typed->scalar) : std::nullopt;
    const bool outside = number && (*number < 7 || *number > 8);  // it has a text of its own
    const auto bits = outside ? *number : in.integer("data_bits", 7, 8).value_or(ascii ? 7 : 8);
    format.data_bits = bits == 7 && ascii ? 7 : 8;
    if (bits == format.data_bits) return;
    in.problem("data_bits", bits == 7 ? "RTU needs 8 data bits; 7 is for ASCII mode"
                                      : "data_bits must be " + std::string(ascii ? "7 or " : "") +
                                            "8, not '" + std::to_string(bits) + '\'');
}

/// Reads the keys of `serial` that set the protocol of a line; a serial master sets it elsewhere.
void load_serial_mode(MapReader& in, SerialFormat& format, Line* line) {
    if (line == nullptr) {
        const bool given = in.refuse("mode",
                                     "is a serial master's framing: write framing: ascii beside "
                                     "serial, or leave it out for RTU");
        if (given) format.mode = SerialMode::ascii;  // accepts 7 and 8 data bits
        return;
    }
    line_serial_keys().read(in, *line);
    constexpr std::array<std::string_view, 1> kAscii{"ascii"};
    if (in.belongs("ascii_lower_case", "mode", kAscii))
        in.problem("ascii_lower_case", "only a line with mode: ascii has hex digits");
}

}  // namespace

bool load_serial(Loading& loading, MapReader& owner, SerialFormat& format, Line* line) {
    const std::size_t before = loading.problems.list().size();
    if (format.mode == SerialMode::ascii) format.data_bits = 7;
    const Node* typed = owner.child("serial");
    const std::string example = serial_example(typed);
    const bool is_list = typed != nullptr && typed->kind == Node::Kind::sequence;
    const bool is_values = is_list && std::ranges::all_of(typed->items, [](const Node& item) {
                               return item.kind == Node::Kind::scalar;
                           });
    if (is_values && !typed->items.empty()) {  // [9600, 8, N, 1]
        owner.has("serial");
        owner.problem("serial", "serial must be a map of keys, not a list; write " + example);
        return false;
    }
    const Node* node = owner.map("serial", example);
    if (node == nullptr) return loading.problems.list().size() == before;
    MapReader in(*node, loading.problems, "serial");
    load_serial_mode(in, format, line);
    load_data_bits(in, format);
    serial_keys().read(in, format);
    in.finish();
    return loading.problems.list().size() == before;
}

namespace {

using modbus::Framing;
using serial_server::Settings;
using tcp_server::BroadcastMode;

constexpr std::string_view kMasterExample = "{name: plc, device: /dev/ttyUSB1, lines: [floor1]}";

/// Two users of one device would take each other's bytes. An invalid device is a problem already.
void check_device(Loading& loading, MapReader& in, const line::Settings& port) {
    if (!port.device.starts_with('/')) return;
    const std::string first = loading.firsts.again("device " + port.device, in.mark("device"));
    for (const Line& line : loading.config.lines) {
        warn_of_same_adapter(loading, in, port.device, "line '" + line.name + '\'',
                             line.device.device);
        if (line.device.device != port.device) continue;
        in.problem("device", "line '" + line.name +
                                 "' has this device already; a master needs a port of its own" +
                                 first);
        return;
    }
    for (const Settings& other : loading.config.serial_masters) {
        warn_of_same_adapter(loading, in, port.device, "serial master '" + other.name + '\'',
                             other.device.device);
        if (other.device.device != port.device) continue;
        in.problem("device", "serial master '" + other.name + "' has this device already" + first);
        return;
    }
}

void check_units(MapReader& in, const Settings& settings) {
    in.schema("units").keys = '^' + yaml::integer_pattern(1, modbus::kMaxStation) + '$';
    for (const auto& [unit, target] : settings.access.units) {
        if (unit != 0 && unit <= modbus::kMaxStation) continue;
        in.problem("units",
                   "a master on a serial line asks units 1 to 247, not " + std::to_string(unit));
    }
}

/// Visits the stations that it can reach, by their own ids or by units.
template <class Use>
void each_station(const Config& config, const Settings& settings, Use use) {
    for (const Line& line : config.lines) {
        const bool own = std::ranges::count(settings.access.lines, line.name) > 0;
        for (std::size_t i = 0; i < line.stations.size(); ++i) {
            const auto is_it = [&](const auto& unit) {
                return unit.second.line == line.name && unit.second.station == line.stations[i].id;
            };
            if (own || std::ranges::any_of(settings.access.units, is_it))
                use(line, line.stations[i], line.arbiter.stations[i]);
        }
    }
}

Duration longest_read(const Line& line, const arbiter::StationSettings& station) {
    const std::size_t bytes =
        std::max<std::size_t>(2 * station.max_registers, (station.max_bits + 7) / 8);
    return frame_time(line.device.serial,
                      modbus::kReadRequestAdu + modbus::kReadReplyOverhead + bytes, 2);
}

/// Warns if a panel may reply after this master's own timeout.
void warn_of_timeout(Loading& loading, MapReader& in, const Settings& settings) {
    if (!settings.response_timeout) return;
    Duration needed{};
    std::string who;
    each_station(
        loading.config, settings,
        [&](const Line& line, const Station& station, const arbiter::StationSettings& timing) {
            const Duration own = timing.response_timeout + longest_read(line, timing) +
                                 silent_interval(settings.device.serial);
            if (own <= needed) return;
            needed = own;
            who = station.name;
        });
    if (needed <= *settings.response_timeout) return;
    const auto text = yaml::format_milliseconds(needed);
    loading.warn(in.mark("response_timeout"),
                 "station '" + who + "' may take " + text +
                     " to answer on its line, and this master waits for " +
                     yaml::format_duration(*settings.response_timeout) +
                     ": set its timeout to more than " + text +
                     " (and what other clients' requests take), or lower response_timeout of the "
                     "station");
}

void warn_of_no_stations(Loading& loading, MapReader& in, const Settings& settings) {
    bool reaches_any = !settings.access.units.empty();
    each_station(loading.config, settings, [&](const auto&...) { reaches_any = true; });
    if (reaches_any) return;
    const std::vector<std::string>& lines = settings.access.lines;
    loading.warn(in.mark(), "serial master '" + settings.name +
                                "' reaches no station: it is answered for listed stations and "
                                "units only; add stations to the line, or units: {31: " +
                                (lines.empty() ? "LINE" : lines.front()) + "/31}");
}

/// Returns the mode set by `framing`; its table reports a wrong value.
SerialMode mode_of(const Node& master) {
    const Node* framing = master.find("framing");
    const bool ascii = framing != nullptr && framing->scalar != modbus::label(Framing::rtu);
    return ascii ? SerialMode::ascii : SerialMode::rtu;
}

/// Keys that users write as on a line.
constexpr std::array<yaml::Elsewhere, 2> kMasterKeysElsewhere{
    {{"mode", {}, {}, "its mode is its framing: write framing: ascii, or leave it out for RTU"},
     {"baud", "serial", {}}}};

Settings load_master(Loading& loading, const Node& node) {
    MapReader in(node, loading.problems, "a serial master", kMasterExample);
    in.elsewhere(kMasterKeysElsewhere);
    Settings settings;
    settings.access.diagnostics_unit.reset();
    settings.name = load_unique_name(loading, in, "serial master");
    const bool serial_known = load_port(loading, in, settings.device, mode_of(node));
    check_device(loading, in, settings.device);
    load_access(loading, in, settings.access);
    check_units(in, settings);
    settings.access.framing = Framing::rtu;
    settings.access.broadcast = BroadcastMode::silent;
    master_keys().read(in, settings);
    settings.response_timeout = in.duration("response_timeout", 1ms, 10min);
    in.finish();
    if (!loading.problems.empty()) return settings;
    if (serial_known) warn_of_timeout(loading, in, settings);
    warn_of_no_stations(loading, in, settings);
    return settings;
}

}  // namespace

void load_serial_masters(Loading& loading, MapReader& root) {
    for (const Node& node : root.entries("serial_masters", "[" + std::string(kMasterExample) + "]"))
        loading.config.serial_masters.push_back(load_master(loading, node));
}

}  // namespace panelgate::config
