#include "tables.hpp"

#include <chrono>
#include <optional>
#include <string>

#include "panelgate/base/decimal.hpp"
#include "panelgate/base/serial_format.hpp"

namespace panelgate::config {
namespace {

using yaml::format_duration;

}  // namespace

const Keys<Config>& root_keys() {
    static const auto kKeys =
        Keys<Config>()
            .other("profiles_dir",
                   "Folder of further panel profiles, relative to this file; its *.yaml add to "
                   "the shipped ones or replace them.",
                   &Config::profiles_dir)
            .other("templates",
                   "Keys that many stations share, by the template's name: all of a "
                   "station's but id and name.")
            .other("lines", "Serial lines, at least one.")
            .other("modbus_tcp", "Listeners for Modbus/TCP.")
            .other("serial_masters",
                   "Masters that ask on serial ports of their own, such as a PLC.")
            .other("http", "REST API, dashboard and metrics.")
            .other("access", "Who may do what: the first rule that matches decides.")
            .other("relays", "Values that are copied from panel to panel.")
            .other("mqtt", "Values published at an MQTT broker.")
            .change_needs(kConnectsAnew)
            .other("log", "Log on stderr.")
            .other("realtime", "Priority over other programs, so that frames are on time.")
            .change_needs(kNextStart)
            .other("audit", "Record of what was done, by whom, in a file that can be proven.");
    return kKeys;
}

const Keys<rt::LogSettings>& log_keys() {
    using Log = rt::LogSettings;
    static constexpr Words<rt::LogLevel, 5> kLevels{{{"error", rt::LogLevel::error},
                                                     {"warn", rt::LogLevel::warn},
                                                     {"info", rt::LogLevel::info},
                                                     {"debug", rt::LogLevel::debug},
                                                     {"trace", rt::LogLevel::trace}}};
    static constexpr Words<rt::LogFormat, 2> kFormats{
        {{"text", rt::LogFormat::text}, {"json", rt::LogFormat::json}}};
    static const auto kKeys =
        Keys<Log>()
            .word("level", &Log::level, kLevels, "Lowest severity that is logged.")
            .word("format", &Log::format, kFormats, "text for people, json for programs.");
    return kKeys;
}

const Keys<rt::RealtimeSettings>& realtime_keys() {
    using Realtime = rt::RealtimeSettings;
    static const auto kKeys =
        Keys<Realtime>()
            .integer("priority", &Realtime::priority, 0, 99,
                     "Priority of SCHED_FIFO, which needs CAP_SYS_NICE; 0: none.")
            .boolean("lock_memory", &Realtime::lock_memory,
                     "Keeps all memory in RAM (mlockall), which needs CAP_IPC_LOCK.");
    return kKeys;
}

const Keys<Line>& line_keys() {
    using arbiter::Quarantine;
    static constexpr Words<Quarantine, 3> kQuarantines{{{"auto", Quarantine::automatic},
                                                        {"line", Quarantine::line},
                                                        {"station", Quarantine::station}}};
    static constexpr Words<bool, 2> kUnlisted{{{"pass", false}, {"refuse", true}}};
    static const auto kKeys =
        Keys<Line>()
            .other("name", "Unique: a-z, 0-9 and '-'.", &Line::name)
            .change_needs(kOpensPort)
            .other("device",
                   "Serial device, tcp://HOST:PORT (RTU over TCP), or sim (simulated panels).")
            .change_needs(kOpensPort)
            .duration(
                "connect_pause", [](auto& line) -> auto& { return line.arbiter.connect_pause; },
                0ms, 1min,
                "Of a tcp:// line: pause behind each connecting, for a device server that ignores "
                "what comes at once.")
            .shown_if([](const Line& line) { return line.kind == Line::Kind::tcp; })
            .other("mode",
                   "listen: another master asks on this line, nothing is ever sent, and "
                   "points show what passes by.",
                   [](const Line& line) { return line.listens ? "listen" : "master"; })
            .initially("master")
            .change_needs(kOpensPort)
            .other("serial", "Character format and framing.")
            .change_needs(kOpensPort)
            .other("rs485", "Direction control of an RS-485 transceiver.")
            .change_needs(kOpensPort)
            .word(
                "echo", [](auto& line) -> auto& { return line.arbiter.echo; }, kEchoes,
                "Whether the adapter hears what it sends; auto: found out by a read.")
            .initially("auto")
            .change_needs(kOpensPort)
            .other("timing", "Times of all its stations; a station's own timing overrides them.")
            .other("retries", "Retries of a read; a write is never repeated on its own.",
                   [](const Line& line) { return line.arbiter.unlisted.retries; })
            .initially("1")
            .other("queue", "Limits of the requests that wait for this line.")
            .other("offline",
                   "When a silent station counts as offline, and how often it is probed then.")
            .word(
                "quarantine", [](auto& line) -> auto& { return line.arbiter.quarantine; },
                kQuarantines,
                "What is suspended after a timeout: the station, the line, or auto, the "
                "line only where replies have been late.")
            .word("unlisted_stations", &Line::refuse_unlisted, kUnlisted,
                  "Stations that are not in the list below: pass, or refuse with exception 0A.")
            .other("simulate", "Of a simulated line: what its adapter does wrong.")
            .change_needs(kOpensPort)
            .other("stations", "Panels on this line.");
    return kKeys;
}

const Keys<line::Settings>& port_keys() {
    static const auto kKeys =
        Keys<line::Settings>().other("device", "A serial device.", &line::Settings::device);
    return kKeys;
}

const Keys<SerialFormat>& serial_keys() {
    using Format = SerialFormat;
    static const auto kKeys =
        Keys<Format>()
            .integer("baud", &Format::baud, 50, 4'000'000, "Bits per second.")
            .other("data_bits",
                   "Data bits of a character: 8 in RTU; 7 or 8 in ASCII, where 7 is the default.",
                   &Format::data_bits)
            .word("parity", &Format::parity, kParityWords, "Of each character.")
            .integer("stop_bits", &Format::stop_bits, 1, 2, "Of each character.");
    return kKeys;
}

const Keys<Line>& line_serial_keys() {
    static const auto kKeys =
        Keys<Line>()
            .word(
                "mode", [](auto& line) -> auto& { return line.device.serial.mode; },
                kSerialModeWords, "Framing of the panels' messages.")
            .word(
                "ascii_lower_case", [](auto& line) -> auto& { return line.arbiter.ascii_digits; },
                kLowerCase, "Whether hex digits a-f are taken.");
    return kKeys;
}

const Keys<Line>& line_fault_keys() {
    static const auto kKeys =
        Keys<Line>().boolean("echo", &Line::simulated_echo, "The adapter hears what it sends.");
    return kKeys;
}

const Keys<line::Rs485>& rs485_keys() {
    using line::Rs485;
    using Mode = Rs485::Mode;
    static constexpr Words<Mode, 3> kModes{
        {{"off", Mode::off}, {"kernel", Mode::kernel}, {"rts", Mode::rts}}};
    static constexpr Words<bool, 2> kLevels{{{"high", true}, {"low", false}}};
    // 0 to 100 ms, as the kernel accepts
    static const auto kKeys =
        Keys<Rs485>()
            .word("mode", &Rs485::mode, kModes,
                  "off: the adapter by itself; kernel: its driver (TIOCSRS485); rts: this "
                  "program, as well as timers allow.")
            .word("rts_on_send", &Rs485::rts_high_on_send, kLevels, "Level of RTS while sending.")
            .duration("delay_before_send", &Rs485::delay_before_send, 0ms, 100ms,
                      "Delay from RTS to the first bit; with mode kernel of whole milliseconds.")
            .duration("delay_after_send", &Rs485::delay_after_send, 0ms, 100ms,
                      "Delay from the last bit to the release of RTS; with mode kernel of whole "
                      "milliseconds.")
            .boolean("receive_during_send", &Rs485::receive_during_send,
                     "The receiver stays on while sending; with mode kernel.");
    return kKeys;
}

const Keys<Timing>& timing_keys() {
    const auto is_adaptive = [](const Timing& timing) { return timing.settings.adaptive_timeout; };
    static const auto kKeys =
        Keys<Timing>()
            .other("response_timeout",
                   "Longest time from the end of a request on the wire to the first byte "
                   "of its reply; adaptive: as the panel has needed it lately.",
                   [=](const Timing& timing) {
                       return is_adaptive(timing)
                                  ? "adaptive"
                                  : format_duration(timing.settings.response_timeout);
                   })
            .initially("500ms")
            .duration(
                "adaptive_floor", [](auto& of) -> auto& { return of.settings.timeout_floor; }, 1ms,
                10s, "Shortest timeout, of response_timeout: adaptive.")
            .shown_if(is_adaptive)
            .other("adaptive_ceiling",
                   "Longest timeout, of response_timeout: adaptive; not below adaptive_floor. "
                   "Without it the line's timeout, or 500ms.",
                   [](const Timing& of) { return of.settings.response_timeout; })
            .shown_if(is_adaptive)
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
                "where "
                "longer than station_gap.")
            .duration("think_time", &Timing::think_time, 0ms, 10s,
                      "Think time of a panel that the plan of `check` assumes.");
    return kKeys;
}

const Keys<Line>& line_timing_keys() {
    static const auto kKeys =
        Keys<Line>()
            .other("reply_hole",
                   "Longest silence inside a reply; auto: 60 ms and 32 characters, on "
                   "tcp:// 700 ms, in ASCII 1 s, longer for a station that pauses so.",
                   [](const Line& line) {
                       return line.arbiter.learns_holes ? "auto"
                                                        : format_duration(line.arbiter.reply_hole);
                   })
            .initially("auto")
            .duration(
                "broadcast_turnaround",
                [](auto& line) -> auto& { return line.arbiter.broadcast_turnaround; }, 1ms, 1min,
                "Pause after a broadcast, in which the panels execute it.");
    return kKeys;
}

const Keys<arbiter::QueueSettings>& queue_keys() {
    using Queue = arbiter::QueueSettings;
    static const auto kKeys =
        Keys<Queue>()
            .integer("limit", &Queue::limit, 1, 4096,
                     "Most requests that wait, of all clients together.")
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
            .duration("probe_min", &Offline::probe_min, 10ms, 1h,
                      "First pause between probes of an offline station.")
            .duration("probe_max", &Offline::probe_max, 10ms, 24h,
                      "Longest pause, at least probe_min, from which it doubles.");
    return kKeys;
}

const Keys<StationBody, StationView>& station_keys() {
    static constexpr Words<bool, 2> kTranslate{{{"auto", true}, {"off", false}}};
    static const auto kKeys =
        Keys<StationBody, StationView>()
            .other("id", "Address of the panel on the line.",
                   [](const StationView& of) { return of.station.id; })
            .other("name", "Name of a-z, 0-9 and '-', unique over all lines. Without it LINE-ID.",
                   [](const StationView& of) { return of.station.name; })
            .other("template", "Template whose keys it takes; the station's own keys win.")
            .other("profile", "Panel profile; `panelgate profiles` lists them.",
                   [](const StationView& of) { return of.station.profile->name; })
            .initially("generic")
            .other("access", "read_only refuses every write.",
                   [](const StationView& of) { return access_text(of.station.read_only); })
            .initially("read_write")
            .other("timing", "Times of this station, in place of the line's.")
            .integer(
                "retries", [](auto& of) -> auto& { return of.settings.retries; }, 0, 10,
                "Retries of a read. Without it the line's.")
            .boolean(
                "retry_writes", [](auto& of) -> auto& { return of.settings.retry_writes; },
                "Sends a write again that was not answered.")
            .initially("false")
            .word(
                "crc_order", [](auto& of) -> auto& { return of.settings.crc_order; },
                modbus::kCrcOrders,
                "Order of the CRC's bytes, on RTU lines. Without it the profile's; high_first: "
                "Autonics GP with firmware from before June 2005.")
            .shown_if([](const StationView& of) { return !of.in_ascii; })
            .change_needs(kOpensPort)
            .duration(
                "max_age", [](auto& of) -> auto& { return of.settings.max_age; }, 0ms, 24h,
                "How old a value may be that answers a client; 0ms: the panel is asked "
                "each time.")
            .initially("0ms")
            .boolean(
                "guard", [](auto& of) -> auto& { return of.station.guard; },
                "Refuses requests that the profile rules out, before they reach the bus.")
            .initially("false")
            .word(
                "translate", [](auto& of) -> auto& { return of.station.translate; }, kTranslate,
                "Sends functions that the panel lacks as ones that it has: 05 and 06 as "
                "15 and 16, and 02 and 04 as 01 and 03 where the profile says that the "
                "memory is the same. Not with a guard.")
            .initially("auto")
            .boolean(
                "any_length", [](auto& of) -> auto& { return of.settings.any_length; },
                "Passes replies to reads (01 to 04) of any length on to Modbus clients, for "
                "registers of 4 or 12 bytes; points and polls still need two bytes a register.")
            .initially("false")
            .other("poll", "Blocks that are polled, to answer clients (max_age).")
            .other("simulate", "Of a simulated panel: what it does wrong.")
            .change_needs(kOpensPort)
            .other("points", "Values by name.");
    return kKeys;
}

const Keys<sim::Misbehaviour>& fault_keys() {
    using Faults = sim::Misbehaviour;
    static const auto kKeys =
        Keys<Faults>()
            .boolean("dead", &Faults::dead, "Executes nothing and answers nothing.")
            .duration("slow", &Faults::slow, 0ms, 10min, "Additional think time.")
            .duration("late_by", &Faults::late_by, 0ms, 10min,
                      "Additional think time of the replies of the share `late`.")
            .share("late", &Faults::late, "Share of replies that are delayed by late_by.")
            .share("drop", &Faults::drop, "Share of requests that it executes and does not answer.")
            .share("damage", &Faults::damage, "Share of replies with a wrong bit.")
            .share("truncate", &Faults::truncate, "Share of replies that are cut in half.")
            .share("foreign_id", &Faults::foreign_id,
                   "Share of replies that carry another address.")
            .share("duplicate", &Faults::duplicate,
                   "Share of requests that a second panel with this address answers, too.");
    return kKeys;
}

const Keys<points::Poll>& poll_keys() {
    using points::Poll;
    constexpr std::int64_t kLargest = 2040;  // the largest read of any panel: GT, ARCT1F501E 1.3.1
    static const auto kKeys =
        Keys<Poll>()
            .other("read", "First register or bit, in the panel's notation.", &Poll::read)
            .integer("count", &Poll::count, 1, kLargest, "Number of registers or bits.")
            .duration("every", &Poll::every, 1ms, points::kSlowest, "Interval between two reads.");
    return kKeys;
}

const Keys<points::Point>& point_keys() {
    using points::Point;
    static constexpr Words<points::WordOrder, 4> kOrders{{{"ABCD", points::kOrders[0]},
                                                          {"BADC", points::kOrders[1]},
                                                          {"CDAB", points::kOrders[2]},
                                                          {"DCBA", points::kOrders[3]}}};
    static const auto kKeys =
        Keys<Point>()
            .other("name", "Name of a-z, 0-9, '-' and '_', unique in its station.", &Point::name)
            .other("at", "Register or bit in the panel's notation, such as UW100 or 400001.",
                   &Point::at)
            .other("bit", "One bit of a register; the type is bool then.", &Point::bit)
            .other("type", "Type of the value. Without it u16; of a bit bool.", &Point::type)
            .other("length", "Characters of a string, two in a register.", &Point::length)
            .word("word_order", &Point::word_order, kOrders,
                  "Order of the bytes of values in registers, not of bits; ABCD: high word first.")
            .other("scale", "Of numbers: value = raw * scale + offset; not 0.", &Point::scale)
            .initially("1")
            .other("offset", "Of numbers: value = raw * scale + offset.", &Point::offset)
            .initially("0")
            .other("unit", "Unit, as people write it.", &Point::unit)
            .other("min", "Of numbers: smallest value that may be written.", &Point::min)
            .other("max", "Of numbers: largest value that may be written.", &Point::max)
            .boolean("writable", &Point::writable, "Clients may write it.")
            .other("labels", "Of integers: texts of raw numbers, such as {0: off, 1: on}.")
            .other("no_value", "Of numbers: raw ones that mean that there is no value.",
                   &Point::no_value)
            .duration("every", &Point::every, 1ms, points::kSlowest, "Interval between two reads.");
    return kKeys;
}

}  // namespace panelgate::config
