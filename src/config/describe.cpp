#include "panelgate/config/describe.hpp"

#include <array>
#include <stdexcept>
#include <string>

#include "panelgate/config/config.hpp"

namespace panelgate::config {

namespace {

/// Has one of each map and list. Keys are recorded whether present or not; beside a keyword (auto)
/// nothing else is read.
constexpr std::string_view kSpecimen = R"(
lines:
  - name: a
    device: sim
    serial: {baud: 9600}
    rs485: {mode: off}
    timing: {reply_hole: 60ms}
    queue: {limit: 256}
    offline: {after: 3}
    simulate: {echo: false}
    stations:
      - id: 1
        name: b
        timing: {frame_gap: 5ms}
        simulate: {dead: false}
        poll: [{read: "400001"}]
        points: [{name: c, at: "400001", labels: {0: zero}, no_value: [1]}]
modbus_tcp:
  - {listen: "127.0.0.1:502", lines: [a], units: {101: a/1}, diagnostics_unit: 255,
     allow: [127.0.0.0/8]}
serial_masters:
  - {name: d, device: /dev/ttyS0, serial: {baud: 9600}, rs485: {mode: off}, lines: [a],
     units: {101: a/1}}
http: {listen: "127.0.0.1:80", hosts: [a], allow: [127.0.0.0/8],
       tokens: [{name: e, role: viewer, file: /f}]}
relays: [{from: b/400001, to: b/400002}]
mqtt: {broker: "mqtt://a"}
log: {level: info}
realtime: {priority: 0}
)";

/// Every file holds a token.
struct Tokens final : Files {
    std::optional<std::string> read(const std::string&) const override {
        return "0123456789abcdef";
    }
    std::optional<std::vector<std::string>> list_yaml(const std::string&) const override {
        return std::nullopt;
    }
};

}  // namespace

Described describe() {
    yaml::Description description;
    yaml::Problems problems("specimen");
    problems.describe(&description);
    if (!load(kSpecimen, Tokens(), problems)) throw std::logic_error(problems.text());
    return {description.keys(), description.rules()};
}

namespace {

constexpr auto kTexts = std::to_array<KeyText>({
    {"profiles_dir", "", "A folder; *.yaml there add to or replace the shipped panel profiles."},
    {"templates", "", "What many stations share, by name: a station's keys but id and name."},

    {"lines", "", "At least one serial line."},
    {"lines/name", "", "Unique: a-z, 0-9 and '-'."},
    {"lines/device", "", "A serial device, tcp://HOST:PORT (RTU over TCP), or sim."},
    {"lines/mode", "master", "listen: another master asks on this line, and nothing is ever sent."},
    {"lines/serial", "", "How characters look on the line."},
    {"lines/serial/baud", "19200", "Bit/s."},
    {"lines/serial/mode", "rtu", "How the panels frame their messages."},
    {"lines/serial/ascii_lower_case", "refuse", "Hex digits a-f, of mode ascii."},
    {"lines/serial/data_bits", "", "8; of mode ascii 7, or 8."},
    {"lines/serial/parity", "even", ""},
    {"lines/serial/stop_bits", "1", ""},
    {"lines/rs485", "", "How the transceiver is switched."},
    {"lines/rs485/mode", "off",
     "off: the adapter by itself; kernel: its driver (TIOCSRS485); rts: this program, as well as "
     "timers allow."},
    {"lines/rs485/rts_on_send", "high", ""},
    {"lines/rs485/delay_before_send", "0ms", "From RTS to the first bit."},
    {"lines/rs485/delay_after_send", "0ms", "From the last bit back."},
    {"lines/rs485/receive_during_send", "false", "The line hears itself, of mode kernel."},
    {"lines/echo", "auto", "The adapter hears itself; auto: found out by a read."},
    {"lines/timing", "", "Of all stations; a station's own timing overrides it."},
    {"lines/timing/response_timeout", "500ms",
     "From the end of the request on the wire to the first byte of the reply."},
    {"lines/timing/adaptive_floor", "20ms", "The shortest, of response_timeout: adaptive."},
    {"lines/timing/adaptive_ceiling", "",
     "The longest, of response_timeout: adaptive; else 500ms, or the line's."},
    {"lines/timing/frame_gap", "auto",
     "Silence between frames: t3.5 (1.75 ms above 19200), or what the profile asks."},
    {"lines/timing/late_window", "auto", "After a timeout, how long a late reply is waited for."},
    {"lines/timing/think_time", "1ms", "What a plan assumes of a panel."},
    {"lines/timing/reply_hole", "auto",
     "The longest silence inside a reply: 60 ms and 32 characters, on tcp:// 700 ms."},
    {"lines/timing/broadcast_turnaround", "100ms", "Rest after a broadcast."},
    {"lines/retries", "1", "Of reads; writes are never repeated on their own."},
    {"lines/queue", "", "Of requests that wait for the line."},
    {"lines/queue/limit", "256", "Of all clients together."},
    {"lines/queue/per_client", "32", ""},
    {"lines/queue/deadline", "2s", "From a request's arrival to its answer."},
    {"lines/offline", "", "When a silent station is set aside, and how often it is probed."},
    {"lines/offline/after", "3", "Silent transactions in a row."},
    {"lines/offline/probe_min", "500ms", "The first pause between probes."},
    {"lines/offline/probe_max", "5s", "The pause doubles up to here."},
    {"lines/quarantine", "auto",
     "What is suspended after a timeout: the station, the line, or auto, the line only where "
     "replies have been late."},
    {"lines/unlisted_stations", "pass", "Stations that are not in the list below."},
    {"lines/simulate", "", "Of the simulated adapter (device sim, run --simulate)."},
    {"lines/simulate/echo", "false", "It hears itself."},

    {"lines/stations", "", "The panels on the line."},
    {"lines/stations/id", "", "Its address."},
    {"lines/stations/name", "", "Unique over all lines: a-z, 0-9 and '-'; LINE-ID without."},
    {"lines/stations/template", "", "One of templates; the station's own keys win."},
    {"lines/stations/profile", "generic", "`panelgate profiles` lists them."},
    {"lines/stations/access", "read_write", ""},
    {"lines/stations/timing", "", "Over the line's."},
    {"lines/stations/timing/response_timeout", "",
     "From the end of the request on the wire to the first byte of the reply."},
    {"lines/stations/timing/adaptive_floor", "", "The shortest, of response_timeout: adaptive."},
    {"lines/stations/timing/adaptive_ceiling", "", "The longest, of response_timeout: adaptive."},
    {"lines/stations/timing/frame_gap", "", "Silence between frames."},
    {"lines/stations/timing/late_window", "",
     "After a timeout, how long a late reply is waited for."},
    {"lines/stations/timing/think_time", "", "What a plan assumes of the panel."},
    {"lines/stations/retries", "", "Of reads; the line's without."},
    {"lines/stations/retry_writes", "false", "A write that was not answered is repeated."},
    {"lines/stations/crc_order", "",
     "The profile's without; high_first: Autonics GP with firmware of before June 2005."},
    {"lines/stations/translate", "auto",
     "What the panel lacks goes out as what it has: 05 and 06 as 15 and 16; not with a guard."},
    {"lines/stations/guard", "false",
     "Refuse what the profile rules out before it reaches the bus."},
    {"lines/stations/max_age", "0ms",
     "How old a value may be that answers a client; 0ms asks the panel."},
    {"lines/stations/poll", "", "Blocks that are read again and again, for max_age."},
    {"lines/stations/poll/read", "", "Where it begins, as the panel names it."},
    {"lines/stations/poll/count", "1", "Registers or bits."},
    {"lines/stations/poll/every", "1s", ""},
    {"lines/stations/simulate", "", "Faults of the simulated panel."},
    {"lines/stations/simulate/dead", "false", "Neither executes nor answers."},
    {"lines/stations/simulate/slow", "0ms", "More think time."},
    {"lines/stations/simulate/late_by", "0ms", "More think time, for the share `late`."},
    {"lines/stations/simulate/late", "0", "A share of its answers."},
    {"lines/stations/simulate/drop", "0", "The share that it executes and does not answer."},
    {"lines/stations/simulate/damage", "0", "The share with a wrong bit."},
    {"lines/stations/simulate/truncate", "0", "The share that is cut in half."},
    {"lines/stations/simulate/foreign_id", "0", "The share that carries another address."},
    {"lines/stations/simulate/duplicate", "0",
     "The share that a second panel with this address answers, too."},

    {"lines/stations/points", "", "Values by name."},
    {"lines/stations/points/name", "", "Unique in the station: a-z, 0-9, '-' and '_'."},
    {"lines/stations/points/at", "", "As the panel names it: UW100, 400001."},
    {"lines/stations/points/bit", "", "One bit of a register; the point is of type bool then."},
    {"lines/stations/points/type", "", "u16 without; of bits bool."},
    {"lines/stations/points/length", "", "Characters of a string, two in a register."},
    {"lines/stations/points/word_order", "ABCD", "ABCD: high word first."},
    {"lines/stations/points/scale", "1", "value = raw * scale + offset."},
    {"lines/stations/points/offset", "0", ""},
    {"lines/stations/points/unit", "", "As people write it."},
    {"lines/stations/points/min", "", "The least that may be written."},
    {"lines/stations/points/max", "", "The most that may be written."},
    {"lines/stations/points/writable", "false", ""},
    {"lines/stations/points/labels", "", "Names of raw numbers: {0: off, 1: on}."},
    {"lines/stations/points/no_value", "", "Raw numbers that mean that there is none."},
    {"lines/stations/points/every", "1s", "How often it is read."},

    {"modbus_tcp", "", "Listeners for Modbus over TCP."},
    {"modbus_tcp/listen", "127.0.0.1:502", "ADDR:PORT or [ADDR]:PORT; port 0 takes a free one."},
    {"modbus_tcp/lines", "", "Names of lines; all without."},
    {"modbus_tcp/units", "", "Further unit ids: {101: floor1/31}."},
    {"modbus_tcp/access", "read_write", ""},
    {"modbus_tcp/framing", "tcp", "The framing of its clients, over TCP."},
    {"modbus_tcp/udp", "false", "The same port for datagrams, too."},
    {"modbus_tcp/ascii_lower_case", "refuse", "Hex digits a-f, of framing ascii."},
    {"modbus_tcp/broadcast", "",
     "Unit 0: reply (once sent; without the key, with framing tcp), silent, deny (exception 01)."},
    {"modbus_tcp/retransmissions", "",
     "The same id, unit and bytes while the first is unanswered: join has one answer and one "
     "frame; without the key writes are joined."},
    {"modbus_tcp/diagnostics_unit", "255", "The gateway's own registers; null: none."},
    {"modbus_tcp/allow", "", "Networks such as 192.168.1.0/24; any address without."},
    {"modbus_tcp/max_connections", "1024", ""},
    {"modbus_tcp/max_connections_per_address", "64", "Then its longest idle one gives way."},

    {"serial_masters", "", "Masters on serial ports of their own, as clients."},
    {"serial_masters/name", "", "Unique: a-z, 0-9 and '-'."},
    {"serial_masters/device", "", "A serial device."},
    {"serial_masters/serial", "", "How characters look there."},
    {"serial_masters/serial/baud", "19200", "Bit/s."},
    {"serial_masters/serial/data_bits", "", "8; of framing ascii 7, or 8."},
    {"serial_masters/serial/parity", "even", ""},
    {"serial_masters/serial/stop_bits", "1", ""},
    {"serial_masters/rs485", "", "How the transceiver is switched."},
    {"serial_masters/rs485/mode", "off",
     "off: the adapter by itself; kernel: its driver (TIOCSRS485); rts: this program."},
    {"serial_masters/rs485/rts_on_send", "high", ""},
    {"serial_masters/rs485/delay_before_send", "0ms", "From RTS to the first bit."},
    {"serial_masters/rs485/delay_after_send", "0ms", "From the last bit back."},
    {"serial_masters/rs485/receive_during_send", "false", "Of mode kernel."},
    {"serial_masters/lines", "", "Names of lines whose listed stations it may ask; all without."},
    {"serial_masters/units", "", "Further unit ids: {7: floor1/31}."},
    {"serial_masters/access", "read_write", ""},
    {"serial_masters/framing", "rtu", "The framing of the master."},
    {"serial_masters/broadcast", "silent", "Unit 0: silent, or deny."},
    {"serial_masters/on_failure", "silence", "What it gets when a panel does not answer."},
    {"serial_masters/echo", "auto", "The adapter hears itself."},
    {"serial_masters/response_timeout", "",
     "The master's own: what would begin later is not sent."},

    {"http", "", "REST, pages and metrics."},
    {"http/listen", "127.0.0.1:8080", "ADDR:PORT or [ADDR]:PORT."},
    {"http/anonymous", "viewer",
     "Without a token: none, viewer (read), operator (read and write)."},
    {"http/hosts", "", "Its names in URLs; the machine's without."},
    {"http/allow", "", "Networks such as 192.168.1.0/24; any address without."},
    {"http/max_connections_per_address", "32",
     "Then its longest idle one gives way; streams of events apart."},
    {"http/tokens", "", "Authorization: Bearer TOKEN."},
    {"http/tokens/name", "", "Unique."},
    {"http/tokens/role", "", "viewer reads, operator writes as well."},
    {"http/tokens/file", "", "Holds the token."},

    {"relays", "", "What is copied from panel to panel."},
    {"relays/from", "", "STATION/NOTATION: press/UW100."},
    {"relays/to", "", "STATION/NOTATION."},
    {"relays/count", "1", "Registers or bits."},
    {"relays/every", "1s", ""},
    {"relays/on_change", "false", "Write only what has changed."},
    {"relays/refresh", "60s", "With on_change: and all again that often."},

    {"mqtt", "", "Values at a broker."},
    {"mqtt/broker", "", "mqtt://HOST:1883, or mqtts://HOST:8883 with TLS."},
    {"mqtt/topic", "panelgate", "TOPIC/STATION/POINT, of format json."},
    {"mqtt/format", "json", "sparkplug has group and node in place of the topic."},
    {"mqtt/group", "", "Of format sparkplug."},
    {"mqtt/node", "", "Of format sparkplug."},
    {"mqtt/qos", "1", "Of format json; 0: what is on its way may be lost."},
    {"mqtt/client_id", "", "panelgate- and the machine's name without."},
    {"mqtt/username", "", ""},
    {"mqtt/password_file", "", "Holds the password."},
    {"mqtt/keep_alive", "60s", "In whole seconds."},
    {"mqtt/store", "10000", "Changes that are kept while the broker is away."},
    {"mqtt/write", "none", "points: clients that may publish TOPIC/+/+/set, or DCMD, write."},
    {"mqtt/ca", "", "A PEM file, with mqtts://; the system's trusted CAs without."},
    {"mqtt/certificate", "", "The gateway's own, a PEM file."},
    {"mqtt/key", "", "Of the certificate, a PEM file."},

    {"log", "", ""},
    {"log/level", "info", ""},
    {"log/format", "text", ""},
    {"realtime", "", "Frames on time beside other work, where the machine grants it."},
    {"realtime/priority", "0", "SCHED_FIFO, 1 to 99; 0: as all programs."},
    {"realtime/lock_memory", "false", "mlockall."},
});

}  // namespace

std::span<const KeyText> key_texts() { return kTexts; }

}  // namespace panelgate::config
