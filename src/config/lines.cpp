// Lines and serial ports: their rows, and what two of their keys say together.

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "hints.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/settings.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using yaml::Node;

constexpr std::string_view kModbusTcp = "modbus-tcp://";

const Keys<Line>& line_serial_keys();
const Keys<arbiter::QueueSettings>& queue_keys();
const Keys<arbiter::OfflineSettings>& offline_keys();
const Keys<Line>& fault_keys();

/// Refuses sim#simulated, /dev/ttyUSB0#left: a '#' begins a comment only after a blank.
bool check_comment(Reader& in, const std::string& device) {
    const std::size_t sign = device.find('#');
    const std::string path = device.substr(0, sign);
    if (sign == device.npos || (path != "sim" && !path.starts_with("/dev/tty"))) return false;
    in.problem("device", "a blank is missing before the '#' of a comment in " +
                             yaml::quote(device) + "; write " + path + ' ' + device.substr(sign));
    return true;
}

void check_tcp_device(Reader& in, const std::string& device) {
    const auto endpoint = line::parse_tcp_device(device);
    if (endpoint && device.starts_with(kModbusTcp)) return;
    if (!endpoint)
        return in.problem("device",
                          "device must be " +
                              std::string(device.starts_with(kModbusTcp) ? kModbusTcp : "tcp://") +
                              "HOST:PORT with a port from 1 to 65535, not " + yaml::quote(device) +
                              device_hint(device));
    if (endpoint->port == "502")  // node-modbus-serial#171, tf03mqtt#4
        in.warn("device",
                "port 502 is the one of Modbus/TCP, and a tcp:// line sends RTU frames: set the "
                "device server to raw (transparent) mode, on any port; for a device that speaks "
                "Modbus/TCP write modbus-tcp://");
}

/// Two lines cannot open one device.
void check_other_lines(Reader& in, const std::string& device) {
    const std::string first = in.loading.firsts.again("device " + device, in.mark("device"));
    for (const Line& other : in.loading.config.lines) {
        if (device == "sim") return;
        for (const std::string& theirs : {other.device.device, other.second}) {
            warn_of_same_adapter(in, device, "line '" + other.name + '\'', theirs);
            if (theirs == device)
                return in.problem("device",
                                  "line '" + other.name + "' has this device already" + first);
        }
    }
}

void check_device(Reader& in, const std::string& device) {
    check_other_lines(in, device);
    if (device.starts_with("tcp://") || device.starts_with(kModbusTcp))
        return check_tcp_device(in, device);
    if (device == "sim") return;
    if (device[0] == '/') return check_path(in, device);
    in.problem("device",
               "device must be an absolute path such as /dev/ttyUSB0, tcp://HOST:PORT, "
               "modbus-tcp://HOST:PORT or sim, not " +
                   yaml::quote(device) + device_hint(device));
}

/// Settles what the line is.
void use_device(Line& line, const std::string& device) {
    line.device.device = device;
    line.device.modbus_tcp = device.starts_with(kModbusTcp);
    const bool is_remote = device.starts_with("tcp://") || line.device.modbus_tcp;
    line.kind = device == "sim" ? Line::Kind::simulated
                : is_remote     ? Line::Kind::tcp
                                : Line::Kind::serial;
    line.arbiter.may_stall = is_remote && !line.device.modbus_tcp;
    if (line.device.modbus_tcp) line.device.serial.baud = SerialFormat::kNoWire;
}

/// Both devices must lead to the same panels in the same way.
void read_second(Reader& in, Line& line, const std::string& device) {
    const auto is_ethernet = [](const std::string& one) { return one.starts_with(kModbusTcp); };
    if (device == line.device.device)
        in.problem("device", "both devices are " + yaml::quote(device) + "; name another one");
    else if (device == "sim" || line.kind == Line::Kind::simulated)
        in.problem("device", "sim has no second device");
    else if (is_ethernet(device) != line.device.modbus_tcp)
        in.problem(
            "device",
            "both devices speak Modbus/TCP (modbus-tcp://), or none: a line's timing is that "
            "of one kind");
    else
        check_device(in, device);
    line.second = device;
}

/// A device, or two in a list.
bool read_device(Reader& in, Line& line) {
    std::vector<std::string> devices;
    const Node* const node = in.child("device");
    if (node != nullptr && node->kind == Node::Kind::sequence) {
        for (const Node* item : in.scalars("device", "[/dev/ttyUSB0, tcp://10.0.0.5:4001]"))
            devices.push_back(item->scalar);
        if (devices.size() != 2)
            in.problem("device",
                       "a list has two devices: the first, and the second that is used "
                       "while the first cannot be opened");
    } else if (const auto device = in.text("device")) {
        devices.push_back(*device);
    }
    if (devices.empty() || devices[0].empty() || check_comment(in, devices[0])) return false;
    check_device(in, devices[0]);
    use_device(line, devices[0]);
    if (devices.size() == 2) read_second(in, line, devices[1]);
    return true;
}

std::string mode_hint(std::string_view typed) {
    const bool of_rs485 = typed == "kernel" || typed == "rts";
    if (!of_rs485 && typed != "ascii" && typed != "rtu") return "";
    const std::string map = of_rs485 ? "rs485" : "serial";
    return "; this mode is of " + map + ": write " + map + ": {mode: " + std::string(typed) + '}';
}

bool read_stations(Reader& in, Line& line) {
    in.loading.line->timing.settings.retries = line.arbiter.unlisted.retries;
    line.arbiter.unlisted = in.loading.line->timing.settings;
    const Node* list = in.sequence("stations", "[{id: 31, name: press}]");
    if (list == nullptr) {
        if (in.child("stations") != nullptr) in.loading.names_missing = true;
        return false;
    }
    for (const Node& node : list->items) load_station(in, node, line);
    return true;
}

KeyShape device_shape() {
    KeyShape shape = text_shape("device", {"^(/|(modbus-)?tcp://.+:[0-9]+$|sim$)", false},
                                "Serial device, tcp://HOST:PORT (RTU over TCP), "
                                "modbus-tcp://HOST:PORT (a device on Ethernet), or sim (simulated "
                                "panels); a list of two: the second is used while the first cannot "
                                "be opened.");
    shape.may_be_pair = true;
    return shape;
}

}  // namespace

Line by_second(Line line) {
    use_device(line, line.second);
    return line;
}

const Keys<Line>& line_keys() {
    using arbiter::Quarantine;
    static constexpr Words<Quarantine, 3> kQuarantines{{{"auto", Quarantine::automatic},
                                                        {"line", Quarantine::line},
                                                        {"station", Quarantine::station}}};
    static constexpr Words<bool, 2> kUnlisted{{{"pass", false}, {"refuse", true}}};
    static constexpr Words<bool, 2> kModes{{{"master", false}, {"listen", true}}};
    static const auto kKeys =
        Keys<Line>()
            .text("name", &Line::name, name_form(), "Unique: a-z, 0-9 and '-'.")
            .required()
            .example("floor1")
            .change_needs(kOpensPort)
            .value(device_shape(), read_device,
                   [](const Line& line) {
                       if (line.second.empty()) return line.device.device;
                       return '[' + line.device.device + ", " + line.second + ']';
                   })
            .required()
            .example("/dev/serial/by-id/usb-adapter")
            .change_needs(kOpensPort)
            .duration(
                "connect_pause", [](auto& line) -> auto& { return line.arbiter.connect_pause; },
                0ms, 1min,
                "Pause behind each connecting of a tcp:// line, for a device server that ignores "
                "what comes at once.")
            .shown_if([](const Line& line) { return line.kind == Line::Kind::tcp; })
            .integer(
                "in_flight", [](auto& line) -> auto& { return line.arbiter.in_flight; }, 1, 16,
                "Requests that may be on their way to a modbus-tcp:// device at the same time.")
            .initially("1")
            .shown_if([](const Line& line) { return line.device.modbus_tcp; })
            .below(
                shape_of("tls", Kind::map,
                         "TLS to a modbus-tcp:// device (Modbus/TCP Security, port 802)."),
                []() -> const Table& { return device_tls_keys(); }, load_device_tls,
                [](const SettingWriter& out, const Line& line, const SettingWriter*) {
                    show_device_tls(out, line);
                })
            .weaker(By::removed)
            .change_needs(kOpensPort)
            .not_empty("give ca, certificate and key, or leave it out")
            .word("mode", &Line::listens, kModes,
                  "listen: another master asks on this line, nothing is ever sent, and points show "
                  "what passes by.",
                  mode_hint)
            .weaker(By::leaving, "listen")
            .change_needs(kOpensPort)
            .below(
                shape_of("serial", Kind::map, "Character format and framing."),
                []() -> const Table& { return line_serial_keys(); },
                [](Reader& in, Line& line) {
                    in.loading.line->serial_known =
                        read_serial(
                            in, [&](Reader& serial) { line_serial_keys().read(serial, line); }) &&
                        !line.device.modbus_tcp;
                    line.arbiter.serial = line.device.serial;
                    return in.has("serial");
                },
                [](const SettingWriter& out, const Line& line, const SettingWriter*) {
                    if (!line.device.modbus_tcp) line_serial_keys().show(out.below("serial"), line);
                })
            .change_needs(kOpensPort)
            .map(
                "rs485", [](auto& line) -> auto& { return line.device.rs485; }, rs485_keys,
                "{mode: off}", kRs485,
                [](Reader& in, Line& line) {
                    check_rs485(in, line.device.rs485);
                    if (line.device.rs485.mode != line::Rs485::Mode::off &&
                        line.kind != Line::Kind::serial)
                        in.problem("mode", "only a serial device has an rs485 mode: '" +
                                               line.device.device + "' switches by itself");
                })
            .change_needs(kOpensPort)
            .word(
                "echo", [](auto& line) -> auto& { return line.arbiter.echo; }, kEchoes,
                "Whether the adapter hears what it sends; auto: found out by a read.")
            .initially("auto")
            .change_needs(kOpensPort)
            .below(
                shape_of("timing", Kind::map,
                         "Times of all its stations; a station's own timing overrides them."),
                []() -> const Table& { return line_timing_keys(); },
                [](Reader& in, Line&) { return load_line_timing(in, *in.loading.line); },
                [](const SettingWriter& out, const Line& line, const SettingWriter*) {
                    line_timing_keys().show(out.below("timing"), line);
                })
            .integer(
                "retries", [](auto& line) -> auto& { return line.arbiter.unlisted.retries; }, 0, 10,
                "Retries of a read; a write is never repeated on its own.")
            .weaker(By::growing)
            .map(
                "queue", [](auto& line) -> auto& { return line.arbiter.queue; }, queue_keys,
                "{limit: 256}", "Limits of the requests that wait for this line.",
                [](Reader& in, Line& line) {
                    arbiter::QueueSettings& queue = line.arbiter.queue;
                    if (in.has("per_client") && queue.per_client > queue.limit)
                        in.problem("per_client", "per_client " + std::to_string(queue.per_client) +
                                                     " is above the limit, " +
                                                     std::to_string(queue.limit) +
                                                     "; make it smaller, or the limit larger");
                    queue.per_client = std::min(queue.per_client, queue.limit);
                })
            .map(
                "offline", [](auto& line) -> auto& { return line.arbiter.offline; }, offline_keys,
                "{after: 3}",
                "When a silent station counts as offline, and how often it is probed then.",
                [](Reader& in, Line& line) {
                    arbiter::OfflineSettings& offline = line.arbiter.offline;
                    if (in.has("probe_max") && offline.probe_max < offline.probe_min)
                        in.problem("probe_max", "probe_max " +
                                                    yaml::format_duration(offline.probe_max) +
                                                    " is below probe_min, " +
                                                    yaml::format_duration(offline.probe_min) +
                                                    "; make it longer, or probe_min shorter");
                    offline.probe_max = std::max(offline.probe_max, offline.probe_min);
                })
            .word(
                "quarantine", [](auto& line) -> auto& { return line.arbiter.quarantine; },
                kQuarantines,
                "What is suspended after a timeout: the station, the line, or auto, the "
                "line only where replies have been late.")
            .word("unlisted_stations", &Line::refuse_unlisted, kUnlisted,
                  "Stations that are not in the list below: pass, or refuse with exception 0A.")
            .weaker(By::leaving, "refuse")
            .map(
                "simulate", [](auto& line) -> auto& { return line; }, fault_keys, "{echo: true}",
                "What the adapter of a simulated line does wrong.")
            .change_needs(kOpensPort)
            .below(
                shape_of("stations", Kind::list, "Panels on this line."),
                []() -> const Table& { return station_keys(); }, read_stations,
                [](const SettingWriter& out, const Line& line, const SettingWriter*) {
                    const bool is_ascii = line.device.serial.mode == SerialMode::ascii;
                    for (std::size_t i = 0; i < line.stations.size(); ++i)
                        station_keys().show(out.item("stations", line.stations[i].name),
                                            {line.stations[i], line.arbiter.stations[i], is_ascii},
                                            &out);
                });
    return kKeys;
}

namespace {

/// A serial master has its protocol elsewhere.
const Keys<Line>& line_serial_keys() {
    static const auto kKeys =
        Keys<Line>()
            .word(
                "mode", [](auto& line) -> auto& { return line.device.serial.mode; },
                kSerialModeWords, "Framing of the panels' messages.")
            .word(
                "ascii_lower_case", [](auto& line) -> auto& { return line.arbiter.ascii_digits; },
                kLowerCase, "Whether hex digits a-f are taken.")
            .only_with("mode", {"ascii"}, "is of a line with mode: ascii, which has hex digits")
            .with(serial_keys(), [](auto& line) -> auto& { return line.device.serial; });
    return kKeys;
}

const Keys<Line>& fault_keys() {
    static const auto kKeys =
        Keys<Line>()
            .boolean("echo", &Line::simulated_echo, "The adapter hears what it sends.")
            .example("false");
    return kKeys;
}

const Keys<arbiter::QueueSettings>& queue_keys() {
    using Queue = arbiter::QueueSettings;
    static const auto kKeys =
        Keys<Queue>()
            .integer("limit", &Queue::limit, 1, 4096,
                     "Most requests that wait, of all clients together.")
            .example("256")
            .integer("per_client", &Queue::per_client, 1, 4096,
                     "Most requests that wait, of one client; at most `limit`.")
            .duration("deadline", &Queue::deadline, 10ms, 10min,
                      "Longest time from a request's arrival to its answer.");
    return kKeys;
}

const Keys<arbiter::OfflineSettings>& offline_keys() {
    using Offline = arbiter::OfflineSettings;
    static const auto kKeys =
        Keys<Offline>()
            .integer("after", &Offline::after, 1, 1000,
                     "Silent transactions in a row until a station counts as offline.")
            .example("3")
            .duration("probe_min", &Offline::probe_min, 10ms, 1h,
                      "First pause between probes of an offline station.")
            .duration("probe_max", &Offline::probe_max, 10ms, 24h,
                      "Longest pause, at least probe_min, from which it doubles.");
    return kKeys;
}

/// Keys that users write beside `device`.
std::vector<yaml::Elsewhere> keys_elsewhere() {
    static constexpr std::array<std::string_view, 3> kParities{"none", "even", "odd"};
    std::vector<yaml::Elsewhere> all{
        {"parity", "serial", {}, {}, kParities},
        {"points", {}, "a station"},
        {"poll", {}, "a station"},
        {"crc_order", {}, "a station"},
        {"any_length", {}, "a station"},
        {"profile", {}, "a station"},
        {"listen", {}, "modbus_tcp or http"},
        {"access", {}, "a station or of modbus_tcp; rules are in 'access' at the top level"},
        {"type", {}, {}, "remove it: 'device' says what the line is"},
        {"framing", {}, {}, "a line has serial: {mode: ascii}, or is RTU without a word"}};
    const auto add = [&all](const Table& table, std::string_view map) {
        for (const std::string_view key : table.names()) all.push_back({key, map, {}});
    };
    add(serial_keys(), "serial");
    add(line_timing_keys(), "timing");
    add(queue_keys(), "queue");
    add(offline_keys(), "offline");
    return all;
}

/// A device on Ethernet has no wire that could be set up.
void check_modbus_tcp(Reader& in, Line& line) {
    for (const std::string_view key : {"serial", "rs485", "echo", "simulate"})
        if (in.has(key))
            in.problem(key, std::string(key) + " belongs to a serial line: " +
                                yaml::quote(line.device.device) + " has none; leave it out");
    line.arbiter.echo = EchoMode::off;
    if (!in.has("in_flight")) line.arbiter.in_flight = 1;
    if (line.listens)
        in.problem("mode",
                   "mode listen needs a line that others can be heard on; a device of "
                   "modbus-tcp:// answers us alone");
}

void check_line(Reader& in, Line& line) {
    if (line.device.modbus_tcp) check_modbus_tcp(in, line);
    if (line.arbiter.in_flight > 1 && !line.device.modbus_tcp)
        in.problem("in_flight",
                   "in_flight belongs to a device of modbus-tcp://, whose replies have a "
                   "transaction id; leave it out");
    if (!line.device.modbus_tcp) line.arbiter.in_flight = 0;
    line.device.listen_only = line.listens;
    if (line.listens && line.kind == Line::Kind::simulated)
        in.problem("mode",
                   "mode listen needs a line with a master; a simulated one has no other master: "
                   "name the device of an adapter that hears the line");
    if (line.listens && line.device.serial.mode == SerialMode::ascii)
        in.problem("mode", "mode listen understands RTU only, not ASCII");
    if (line.kind != Line::Kind::tcp && !line.device.device.empty() &&
        line.arbiter.connect_pause > Duration::zero())
        in.problem("connect_pause",
                   "connect_pause belongs to a tcp:// line, whose device server may ignore what "
                   "comes right behind a connection; " +
                       yaml::quote(line.device.device) + " has no connection: leave it out");
}

/// Warns of keys that only a master uses.
void warn_of_unused_keys(Reader& in, const Line& line) {
    if (line.device.rs485.mode != line::Rs485::Mode::off) warn_of_unused_key(in, "rs485");
    for (const std::string_view key :
         {"connect_pause", "echo", "retries", "queue", "quarantine", "unlisted_stations"})
        if (in.has(key)) warn_of_unused_key(in, key);
}

}  // namespace

std::optional<Line> load_line(Reader& root, const Node& node) {
    Loading& loading = root.loading;
    Reader in(loading, node, "a line", "{name: floor1, device: /dev/ttyUSB0}");
    static const std::vector<yaml::Elsewhere> kElsewhere = keys_elsewhere();
    in.elsewhere(kElsewhere);
    in.elsewhere(loading.top_keys);
    Line line;
    line.arbiter.echo = EchoMode::automatic;  // an arbiter of its own expects none
    LineContext work{line};
    loading.line = &work;
    line_keys().read(in, line);
    loading.line = nullptr;
    check_unique(in, "line", line.name);
    if (!line.name.empty()) loading.config.line_marks.emplace(line.name, in.mark("name"));
    check_line(in, line);
    warn_of_stations(in, work);
    in.finish();
    if (line.listens) warn_of_unused_keys(in, line);
    if (work.serial_known && !line.listens) warn_of_deadline(loading, node, line);
    return line;
}

void warn_of_same_adapter(Reader& in, const std::string& device, const std::string& owner,
                          const std::string& other) {
    if (device == other || !device.starts_with('/') || !other.starts_with('/')) return;
    const std::string real = in.loading.files.real_path(device);
    if (real != in.loading.files.real_path(other)) return;
    in.warn("device", device + " and " + other + " of " + owner + " are one adapter, " + real +
                          ": only one of the two can open it; name another device");
}

void warn_of_unused_key(Reader& in, std::string_view key) {
    in.warn(key, std::string(key) +
                     " does nothing on a line that is only listened to (mode: listen): nothing is "
                     "sent there; leave it out");
}

}  // namespace panelgate::config
