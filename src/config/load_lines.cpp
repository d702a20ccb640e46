#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include "hints.hpp"
#include "load_serial.hpp"
#include "load_stations.hpp"
#include "loader.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/yaml/document.hpp"
#include "tables.hpp"

namespace panelgate::config {
namespace {

using yaml::MapReader;
using yaml::Node;

void load_queue(MapReader& in, arbiter::QueueSettings& queue) {
    const Given given = queue_keys().read(in, queue);
    if (given.has("per_client") && queue.per_client > queue.limit)
        in.problem("per_client", "per_client " + std::to_string(queue.per_client) +
                                     " is above the limit, " + std::to_string(queue.limit) +
                                     "; make it smaller, or the limit larger");
    queue.per_client = std::min(queue.per_client, queue.limit);
}

void load_offline(MapReader& in, arbiter::OfflineSettings& offline) {
    const Given given = offline_keys().read(in, offline);
    if (given.has("probe_max") && offline.probe_max < offline.probe_min)
        in.problem("probe_max", "probe_max " + yaml::format_duration(offline.probe_max) +
                                    " is below probe_min, " +
                                    yaml::format_duration(offline.probe_min) +
                                    "; make it longer, or probe_min shorter");
    offline.probe_max = std::max(offline.probe_max, offline.probe_min);
}

void check_rs485_delay(MapReader& in, std::string_view key, Duration delay) {
    if (delay % 1ms == Duration::zero()) return;
    in.problem(key, std::string(key) + " must be whole milliseconds in rs485 mode kernel, not " +
                        yaml::format_duration(delay));
}

void load_rs485(MapReader& in, const Line& line, line::Rs485& rs485) {
    using Mode = line::Rs485::Mode;
    rs485_keys().read(in, rs485);
    if (rs485.mode == Mode::kernel) {
        check_rs485_delay(in, "delay_before_send", rs485.delay_before_send);
        check_rs485_delay(in, "delay_after_send", rs485.delay_after_send);
    }
    if (rs485.receive_during_send && rs485.mode == Mode::rts) {
        in.problem(
            "receive_during_send",
            "receive_during_send belongs to rs485 mode kernel: with rts the adapter's wiring "
            "decides it");
    }
    constexpr std::array<std::string_view, 2> kSwitched{"kernel", "rts"};
    for (const std::string_view key :
         {"rts_on_send", "delay_before_send", "delay_after_send", "receive_during_send"}) {
        if (in.belongs(key, "mode", kSwitched))
            in.problem(key, std::string(key) + " belongs to rs485 mode kernel or rts");
    }
    if (rs485.mode != Mode::off && line.kind != Line::Kind::serial) {
        in.problem("mode", "only a serial device has an rs485 mode: '" + line.device.device +
                               "' switches by itself");
    }
}

/// Refuses /dev/ttyUSB0:9600 and the like; other paths may contain colons.
void check_path(MapReader& in, const std::string& path) {
    const std::size_t end = path.find_first_of(":,; \t");
    if (!path.starts_with("/dev/tty") || end == path.npos) return;
    if (end + 1 == path.size()) {
        in.problem("device", "device must be a path alone, not " + yaml::quote(path) + "; write " +
                                 path.substr(0, end));
        return;
    }
    const std::string number = path.substr(std::min(path.find_first_not_of(' ', end), path.size()));
    constexpr std::size_t kLongest = 2;  // digits of /dev/ttyUSB12
    if (path[end] == ' ' && number.size() <= kLongest && yaml::parse_integer(number)) {
        in.problem("device", "device must be a path without blanks, not " + yaml::quote(path) +
                                 "; write " + path.substr(0, end) + number);
        return;
    }
    Node behind;
    behind.scalar = path.substr(end);
    in.problem("device", "device must be a path alone, not " + yaml::quote(path) + "; write " +
                             path.substr(0, end) +
                             ", and what is behind it as serial: " + serial_example(&behind));
}

/// Refuses sim#simulated, /dev/ttyUSB0#left: a '#' begins a comment only after a blank.
bool check_comment(MapReader& in, const std::string& device) {
    const std::size_t sign = device.find('#');
    const std::string path = device.substr(0, sign);
    if (sign == device.npos || (path != "sim" && !path.starts_with("/dev/tty"))) return false;
    in.problem("device", "a blank is missing before the '#' of a comment in " +
                             yaml::quote(device) + "; write " + path + ' ' + device.substr(sign));
    return true;
}

void check_tcp_device(Loading& loading, MapReader& in, const std::string& device) {
    const auto endpoint = line::parse_tcp_device(device);
    if (!endpoint)
        return in.problem("device",
                          "device must be tcp://HOST:PORT with a port from 1 to 65535, not " +
                              yaml::quote(device) + device_hint(device));
    if (endpoint->port == "502")  // node-modbus-serial#171, tf03mqtt#4
        loading.warn(in.mark("device"),
                     "port 502 is the one of Modbus/TCP, and a tcp:// line sends RTU frames: set "
                     "the device server to raw (transparent) mode, on any port");
}

void load_device(Loading& loading, MapReader& in, Line& line) {
    line.device.device = in.required_text("device").value_or("");
    in.looks_like("device", "^(/|tcp://.+:[0-9]+$|sim$)");
    if (check_comment(in, line.device.device)) return;
    const std::string first =
        loading.firsts.again("device " + line.device.device, in.mark("device"));
    for (const Line& other : loading.config.lines) {
        if (line.device.device == "sim" || line.device.device.empty()) break;
        warn_of_same_adapter(loading, in, line.device.device, "line '" + other.name + '\'',
                             other.device.device);
        if (other.device.device != line.device.device) continue;
        in.problem("device", "line '" + other.name + "' has this device already" + first);
        break;
    }
    if (line.device.device == "sim") {
        line.kind = Line::Kind::simulated;
    } else if (line.device.device.starts_with("tcp://")) {
        line.kind = Line::Kind::tcp;
        line.arbiter.may_stall = true;
        check_tcp_device(loading, in, line.device.device);
    } else if (!line.device.device.empty() && line.device.device[0] != '/') {
        in.problem(
            "device",
            "device must be an absolute path such as /dev/ttyUSB0, tcp://HOST:PORT or sim, not " +
                yaml::quote(line.device.device) + device_hint(line.device.device));
    } else {
        check_path(in, line.device.device);
    }
}

/// `connect_pause` needs a connection.
void check_connect_pause(MapReader& in, const Line& line) {
    if (line.kind == Line::Kind::tcp || line.device.device.empty()) return;
    if (line.arbiter.connect_pause > Duration::zero())
        in.problem("connect_pause",
                   "connect_pause belongs to a tcp:// line, whose device server may ignore what "
                   "comes right behind a connection; " +
                       yaml::quote(line.device.device) + " has no connection: leave it out");
}

/// Reads which master is on this line: the gateway or another one.
void load_mode(MapReader& in, Line& line) {
    const Node* given = in.child("mode");
    if (given != nullptr && (given->scalar == "kernel" || given->scalar == "rts")) {
        in.problem("mode", "mode " + given->scalar +
                               " is of rs485; write rs485: {mode: " + given->scalar + '}');
        in.has("mode");
        return;
    }
    constexpr std::array<std::string_view, 2> kModes{"master", "listen"};
    if (given != nullptr && (given->scalar == "ascii" || given->scalar == "rtu")) {
        in.problem("mode", "mode " + given->scalar +
                               " is of serial; write serial: {mode: " + given->scalar + '}');
        in.has("mode");
        return;
    }
    line.listens = in.choice_index("mode", kModes) == std::size_t{1};
    line.device.listen_only = line.listens;
    if (line.listens && line.kind == Line::Kind::simulated) {
        in.problem("mode",
                   "mode listen needs a line with a master; a simulated one has no other master: "
                   "name the device of an adapter that hears the line");
    }
}

constexpr std::string_view kRs485Example = "{mode: off}";
constexpr std::string_view kLineExample = "{name: floor1, device: /dev/ttyUSB0}";
constexpr std::string_view kLineListExample = "[{name: floor1, device: /dev/ttyUSB0}]";

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
        {"framing", {}, {}, "a line has serial: {mode: ascii}, or is RTU without a word"},
        {"method", {}, {}, "remove it: a line is RTU, or has serial: {mode: ascii}"}};
    const auto add = [&all](const std::vector<std::string_view>& keys, std::string_view map) {
        for (const std::string_view key : keys) all.push_back({key, map, {}});
    };
    add(serial_keys().names(), "serial");
    add(timing_keys().names(), "timing");
    add(line_timing_keys().names(), "timing");
    add(queue_keys().names(), "queue");
    add(offline_keys().names(), "offline");
    return all;
}

/// Warns of keys that only a master uses.
void warn_of_unused_keys(Loading& loading, MapReader& in, const Line& line) {
    if (line.device.rs485.mode != line::Rs485::Mode::off) warn_of_unused_key(loading, in, "rs485");
    for (const std::string_view key :
         {"connect_pause", "echo", "retries", "queue", "quarantine", "unlisted_stations"}) {
        if (in.has(key)) warn_of_unused_key(loading, in, key);
    }
}

Line load_line(Loading& loading, const Node& node) {
    MapReader in(node, loading.problems, "a line", kLineExample);
    static const std::vector<yaml::Elsewhere> kElsewhere = keys_elsewhere();
    in.elsewhere(kElsewhere);
    in.elsewhere(loading.top_keys);
    Line line;
    line.name = load_unique_name(loading, in, "line");
    if (!line.name.empty()) loading.config.line_marks.emplace(line.name, in.mark("name"));
    load_device(loading, in, line);
    load_mode(in, line);
    const bool serial_known = load_serial(loading, in, line.device.serial, &line);
    if (line.listens && line.device.serial.mode == SerialMode::ascii)
        in.problem("mode", "mode listen understands RTU only, not ASCII");
    line.arbiter.serial = line.device.serial;
    load_map(in, "rs485", kRs485Example,
             [&](MapReader& rs485) { load_rs485(rs485, line, line.device.rs485); });
    line.arbiter.echo = EchoMode::automatic;  // an arbiter of its own expects none
    line_keys().read(in, line);
    check_connect_pause(in, line);
    load_map(in, "queue", "{limit: 256}",
             [&](MapReader& queue) { load_queue(queue, line.arbiter.queue); });
    load_map(in, "offline", "{after: 3}",
             [&](MapReader& offline) { load_offline(offline, line.arbiter.offline); });
    load_map(in, "simulate", "{echo: true}",
             [&](MapReader& faults) { line_fault_keys().read(faults, line); });
    load_stations(loading, in, {line, serial_known, {}});
    in.finish();
    if (line.listens) warn_of_unused_keys(loading, in, line);
    if (serial_known && !line.listens) warn_of_deadline(loading, node, line);
    return line;
}

}  // namespace

void warn_of_same_adapter(Loading& loading, MapReader& in, const std::string& device,
                          const std::string& owner, const std::string& other) {
    if (device == other || !device.starts_with('/') || !other.starts_with('/')) return;
    const std::string real = loading.files.real_path(device);
    if (real != loading.files.real_path(other)) return;
    loading.warn(in.mark("device"), device + " and " + other + " of " + owner +
                                        " are one adapter, " + real +
                                        ": only one of the two can open it; name another device");
}

bool load_port(Loading& loading, MapReader& in, line::Settings& port, SerialMode mode) {
    Line line;  // for load_rs485(): a port has some of a line's keys
    line.device.device = port.device = in.required_text("device").value_or("");
    in.looks_like("device", "^/");
    if (!port.device.empty() && port.device[0] != '/') {
        const bool remote = port.device.starts_with("tcp://");
        in.problem("device", "device must be a serial device such as /dev/ttyUSB1, not " +
                                 yaml::quote(port.device) +
                                 (remote ? "; a master's silences do not come through a network"
                                         : device_hint(port.device)));
    } else {
        check_path(in, port.device);
    }
    port.serial.mode = mode;
    const bool serial_known = load_serial(loading, in, port.serial, nullptr);
    load_map(in, "rs485", kRs485Example,
             [&](MapReader& rs485) { load_rs485(rs485, line, port.rs485); });
    return serial_known;
}

void refuse_no_lines(Loading& loading, MapReader& root) {
    loading.problems.add(root.mark("lines"),
                         "a configuration needs at least one line in 'lines', such as lines: " +
                             std::string(kLineListExample));
}

void load_lines(Loading& loading, MapReader& root) {
    const Node* list = root.sequence("lines", kLineListExample);
    yaml::KeyShape& schema = root.schema("lines");
    schema.required = true;
    schema.may_be_null = false;
    schema.fewest = 1;
    if (list == nullptr && root.is_mistyped("lines")) return;
    loading.names_missing = list == nullptr && root.child("lines") != nullptr;
    if (loading.names_missing) return;
    if (list == nullptr || list->items.empty()) {
        refuse_no_lines(loading, root);
        return;
    }
    for (const Node& node : list->items) loading.config.lines.push_back(load_line(loading, node));
}

}  // namespace panelgate::config
