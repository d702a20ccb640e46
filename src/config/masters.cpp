// Serial masters: rows of the table, and checks of a master's port against lines and panels.

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using modbus::Framing;
using tcp_server::BroadcastMode;
using Master = serial_server::Settings;
using yaml::Node;

/// Two users of one device would take each other's bytes. An invalid device is a problem already.
void check_device(Reader& in, const line::Settings& port) {
    if (!port.device.starts_with('/')) return;
    const std::string first = in.loading.firsts.again("device " + port.device, in.mark("device"));
    for (const Line& line : in.loading.config.lines) {
        warn_of_same_adapter(in, port.device, "line '" + line.name + '\'', line.device.device);
        if (line.device.device != port.device && line.second != port.device) continue;
        in.problem("device", "line '" + line.name +
                                 "' has this device already; a master needs a port of its own" +
                                 first);
        return;
    }
    for (const Master& other : in.loading.config.serial_masters) {
        warn_of_same_adapter(in, port.device, "serial master '" + other.name + '\'',
                             other.device.device);
        if (other.device.device != port.device) continue;
        in.problem("device", "serial master '" + other.name + "' has this device already" + first);
        return;
    }
}

/// Visits the stations that it can reach, by their own ids or by units.
template <class Use>
void each_station(const Config& config, const Master& settings, Use use) {
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
void warn_of_timeout(Reader& in, const Master& settings) {
    if (!settings.response_timeout) return;
    Duration needed{};
    std::string who;
    each_station(
        in.loading.config, settings,
        [&](const Line& line, const Station& station, const arbiter::StationSettings& timing) {
            const Duration own = timing.response_timeout + longest_read(line, timing) +
                                 silent_interval(settings.device.serial);
            if (own <= needed) return;
            needed = own;
            who = station.name;
        });
    if (needed <= *settings.response_timeout) return;
    const auto text = yaml::format_milliseconds(needed);
    in.warn("response_timeout",
            "station '" + who + "' may take " + text +
                " to answer on its line, and this master waits for " +
                yaml::format_duration(*settings.response_timeout) +
                ": set its timeout to more than " + text +
                " (and what other clients' requests take), or lower response_timeout of the "
                "station");
}

void warn_of_no_stations(Reader& in, const Master& settings) {
    bool reaches_any = !settings.access.units.empty();
    each_station(in.loading.config, settings, [&](const auto&...) { reaches_any = true; });
    if (reaches_any) return;
    const std::vector<std::string>& lines = settings.access.lines;
    in.loading.warn(in.mark(), "serial master '" + settings.name +
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

}  // namespace

const Keys<Master>& master_keys() {
    using serial_server::OnFailure;
    static constexpr Words<Framing, 2> kFramings{
        {{"rtu", Framing::rtu}, {"ascii", Framing::ascii}}};
    static constexpr Words<BroadcastMode, 2> kBroadcasts{
        {{"silent", BroadcastMode::silent}, {"deny", BroadcastMode::deny}}};
    static constexpr Words<OnFailure, 2> kFailures{
        {{"exception", OnFailure::exception}, {"silence", OnFailure::silence}}};
    static const auto kKeys =
        Keys<Master>()
            .text("name", &Master::name, name_form(), "Unique: a-z, 0-9 and '-'.")
            .required()
            .example("plc")
            .with(port_keys(), [](auto& master) -> auto& { return master.device; })
            .with(make_reach_keys(1, modbus::kMaxStation),
                  [](auto& master) -> auto& { return master.access; })
            .word(
                "framing", [](auto& master) -> auto& { return master.access.framing; }, kFramings,
                "Framing of the master.")
            .initially("rtu")
            .change_needs(kOpensPort)
            .word(
                "broadcast", [](auto& master) -> auto& { return master.access.broadcast; },
                kBroadcasts,
                "Broadcasts of the master: silent sends them on, deny does not. They "
                "have no answer in either case.")
            .weaker(By::leaving, "deny")
            .initially("silent")
            .word("on_failure", &Master::on_failure, kFailures,
                  "What the master gets if a panel does not answer.")
            .word("echo", &Master::echo, kEchoes,
                  "Whether the adapter hears what it sends; auto: found out.")
            .change_needs(kOpensPort)
            .duration("response_timeout", &Master::response_timeout, 1ms, 10min,
                      "How long the master waits: what would be sent later is not sent. "
                      "Without it no limit but the deadline.")
            .change_needs(kOpensPort);
    return kKeys;
}

std::optional<Master> load_master(Reader& root, const Node& node) {
    static constexpr std::array<yaml::Elsewhere, 2> kKeysElsewhere{
        {{"mode", {}, {}, "its mode is its framing: write framing: ascii, or leave it out for RTU"},
         {"baud", "serial", {}}}};
    Reader in(root.loading, node, "a serial master",
              "{name: plc, device: /dev/ttyUSB1, lines: [floor1]}");
    in.elsewhere(kKeysElsewhere);
    Master settings;
    settings.access.framing = Framing::rtu;
    settings.access.broadcast = BroadcastMode::silent;
    settings.device.serial.mode = mode_of(node);
    if (settings.device.serial.mode == SerialMode::ascii) settings.device.serial.data_bits = 7;
    master_keys().read(in, settings);
    check_unique(in, "serial master", settings.name);
    check_device(in, settings.device);
    check_overlap(in, settings.access);
    for (const auto& [unit, target] : settings.access.units)
        if (unit == 0 || unit > modbus::kMaxStation)
            in.problem("units", "a master on a serial line asks units 1 to 247, not " +
                                    std::to_string(unit));
    in.finish();
    if (!in.problems().empty()) return settings;
    warn_of_timeout(in, settings);
    warn_of_no_stations(in, settings);
    return settings;
}

}  // namespace panelgate::config
