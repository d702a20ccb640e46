#include "tables.hpp"

#include <optional>
#include <string>

#include "panelgate/base/decimal.hpp"
#include "panelgate/base/serial_format.hpp"

namespace panelgate::config {
namespace {

using yaml::format_duration;

std::string or_auto(const std::optional<Duration>& duration) {
    return duration ? format_duration(*duration) : "auto";
}

}  // namespace

const Keys<Config>& root_keys() {
    static const auto kKeys =
        Keys<Config>()
            .other("profiles_dir",
                   "A folder; *.yaml there add to or replace the shipped panel profiles.")
            .other("templates",
                   "What many stations share, by name: a station's keys but id and name.")
            .other("lines", "At least one serial line.")
            .other("modbus_tcp", "Listeners for Modbus over TCP.")
            .other("serial_masters", "Masters on serial ports of their own, as clients.")
            .change_needs(kOpensPort)
            .other("http", "REST, pages and metrics.")
            .other("relays", "What is copied from panel to panel.")
            .other("mqtt", "Values at a broker.")
            .change_needs(kConnectsAnew)
            .other("log", "What is logged on stderr.")
            .other("realtime", "Frames on time beside other work, where the machine grants it.")
            .change_needs(kNextStart);
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
            .word("level", &Log::level, kLevels, "The least that is logged.")
            .word("format", &Log::format, kFormats, "Lines for people, or for programs.");
    return kKeys;
}

const Keys<rt::RealtimeSettings>& realtime_keys() {
    using Realtime = rt::RealtimeSettings;
    static const auto kKeys =
        Keys<Realtime>()
            .integer("priority", &Realtime::priority, 0, 99,
                     "SCHED_FIFO, 1 to 99, where the machine grants it (CAP_SYS_NICE); "
                     "0: as all programs.")
            .boolean("lock_memory", &Realtime::lock_memory,
                     "Memory stays in RAM (mlockall, CAP_IPC_LOCK).");
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
            .other("name", "Unique: a-z, 0-9 and '-'.")
            .change_needs(kOpensPort)
            .other("device", "A serial device, tcp://HOST:PORT (RTU over TCP), or sim.")
            .change_needs(kOpensPort)
            .other("mode",
                   "listen: another master asks on this line, nothing is ever sent, and points "
                   "show what "
                   "passes by.",
                   [](const Line& line) { return line.listens ? "listen" : "master"; })
            .initially("master")
            .change_needs(kOpensPort)
            .other("serial", "How characters look on the line.")
            .change_needs(kOpensPort)
            .other("rs485", "How the transceiver is switched.")
            .change_needs(kOpensPort)
            .word(
                "echo", [](auto& line) -> auto& { return line.arbiter.echo; }, kEchoes,
                "The adapter hears itself; auto: found out by a read.")
            .initially("auto")
            .change_needs(kOpensPort)
            .other("timing", "Of all stations; a station's own timing overrides it.")
            .other("retries", "Of reads; writes are never repeated on their own.",
                   [](const Line& line) { return std::to_string(line.arbiter.unlisted.retries); })
            .initially("1")
            .other("queue", "Of requests that wait for the line.")
            .other("offline", "When a silent station is set aside, and how often it is probed.")
            .word(
                "quarantine", [](auto& line) -> auto& { return line.arbiter.quarantine; },
                kQuarantines,
                "What is suspended after a timeout: the station, the line, or auto, the line "
                "only where replies have been late.")
            .word("unlisted_stations", &Line::refuse_unlisted, kUnlisted,
                  "Stations that are not in the list below: pass, or refuse with exception 0A.")
            .other("simulate", "The simulated adapter, of device sim and run --simulate.")
            .change_needs(kOpensPort)
            .other("stations", "The panels on the line.");
    return kKeys;
}

const Keys<line::Settings>& port_keys() {
    static const auto kKeys = Keys<line::Settings>().other(
        "device", "A serial device.", [](const line::Settings& port) { return port.device; });
    return kKeys;
}

const Keys<SerialFormat>& serial_keys() {
    using Format = SerialFormat;
    static const auto kKeys =
        Keys<Format>()
            .integer("baud", &Format::baud, 50, 4'000'000, "Bit/s.")
            .other("data_bits", "8; in ASCII 7, or 8.",
                   [](const Format& format) { return std::to_string(format.data_bits); })
            .word("parity", &Format::parity, kParityWords, "Of each character.")
            .integer("stop_bits", &Format::stop_bits, 1, 2, "Of each character.");
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
                  "off: the adapter by itself; kernel: its driver (TIOCSRS485); rts: this program, "
                  "as well as timers allow.")
            .word("rts_on_send", &Rs485::rts_high_on_send, kLevels,
                  "The level of RTS while sending.")
            .duration("delay_before_send", &Rs485::delay_before_send, 0ms, 100ms,
                      "From RTS to the first bit.")
            .duration("delay_after_send", &Rs485::delay_after_send, 0ms, 100ms,
                      "From the last bit back.")
            .boolean("receive_during_send", &Rs485::receive_during_send,
                     "The line hears itself, of mode kernel.");
    return kKeys;
}

const Keys<arbiter::StationSettings>& timing_keys() {
    using Settings = arbiter::StationSettings;
    static const auto kKeys =
        Keys<Settings>()
            .other("response_timeout",
                   "From the end of the request on the wire to the first byte of the reply.",
                   [](const Settings& settings) {
                       const std::string longest = format_duration(settings.response_timeout);
                       if (!settings.adaptive_timeout) return longest;
                       return "adaptive, " + format_duration(settings.timeout_floor) + " to " +
                              longest;
                   })
            .initially("500ms")
            .other("adaptive_floor", "The shortest, of response_timeout: adaptive.")
            .initially("20ms")
            .other("adaptive_ceiling",
                   "The longest, of response_timeout: adaptive; else 500ms, or the line's.")
            .other("frame_gap",
                   "Silence between frames; auto: 3.5 characters (1.75 ms above 19200 baud), or "
                   "what the "
                   "profile asks; 0 only on sim and tcp:// and in ASCII.",
                   [](const Settings& settings) { return or_auto(settings.frame_gap); })
            .initially("auto")
            .other("late_window", "After a timeout, how long a late reply is waited for.",
                   [](const Settings& settings) { return or_auto(settings.late_window); })
            .initially("auto")
            .other("think_time", "What a plan assumes of a panel.")
            .initially("1ms");
    return kKeys;
}

const Keys<LineTiming>& line_timing_keys() {
    static const auto kKeys =
        Keys<LineTiming>()
            .other("reply_hole",
                   "The longest silence inside a reply; auto: 60 ms and 32 characters, on tcp:// "
                   "700 ms, "
                   "in ASCII 1 s.",
                   [](const LineTiming& line) { return format_duration(line.reply_hole); })
            .initially("auto")
            .duration("broadcast_turnaround", &LineTiming::broadcast_turnaround, 1ms, 1min,
                      "Rest after a broadcast.");
    return kKeys;
}

const Keys<arbiter::QueueSettings>& queue_keys() {
    using Queue = arbiter::QueueSettings;
    static const auto kKeys =
        Keys<Queue>()
            .integer("limit", &Queue::limit, 1, 4096, "Of all clients together.")
            .integer("per_client", &Queue::per_client, 1, 4096, "Of one client.")
            .duration("deadline", &Queue::deadline, 10ms, 10min,
                      "From a request's arrival to its answer.");
    return kKeys;
}

const Keys<arbiter::OfflineSettings>& offline_keys() {
    using Offline = arbiter::OfflineSettings;
    static const auto kKeys =
        Keys<Offline>()
            .integer("after", &Offline::after, 1, 1000, "Silent transactions in a row.")
            .duration("probe_min", &Offline::probe_min, 10ms, 1h, "The first pause between probes.")
            .duration("probe_max", &Offline::probe_max, 10ms, 24h, "The pause doubles up to here.");
    return kKeys;
}

const Keys<StationBody, StationView>& station_keys() {
    static constexpr Words<bool, 2> kTranslate{{{"auto", true}, {"off", false}}};
    static const auto kKeys =
        Keys<StationBody, StationView>()
            .other("id", "Its address.",
                   [](const StationView& of) { return std::to_string(of.station.id); })
            .other("name", "Unique over all lines: a-z, 0-9 and '-'; LINE-ID without.")
            .other("template", "One of templates; the station's own keys win.")
            .other("profile", "`panelgate profiles` lists them.",
                   [](const StationView& of) { return of.station.profile->name; })
            .initially("generic")
            .other("access", "read_only refuses whatever writes.",
                   [](const StationView& of) { return access_text(of.station.read_only); })
            .initially("read_write")
            .other("timing", "Over the line's.")
            .integer(
                "retries", [](auto& of) -> auto& { return of.settings.retries; }, 0, 10,
                "Of reads; the line's without.")
            .boolean(
                "retry_writes", [](auto& of) -> auto& { return of.settings.retry_writes; },
                "A write that was not answered is repeated.")
            .initially("false")
            .word(
                "crc_order", [](auto& of) -> auto& { return of.settings.crc_order; },
                modbus::kCrcOrders,
                "The profile's without; high_first: Autonics GP with firmware of before June "
                "2005.")
            .change_needs(kOpensPort)
            .duration(
                "max_age", [](auto& of) -> auto& { return of.settings.max_age; }, 0ms, 24h,
                "How old a value may be that answers a client; 0ms asks the panel.")
            .initially("0ms")
            .boolean(
                "guard", [](auto& of) -> auto& { return of.station.guard; },
                "Refuse what the profile rules out before it reaches the bus.")
            .initially("false")
            .word(
                "translate", [](auto& of) -> auto& { return of.station.translate; }, kTranslate,
                "What the panel lacks goes out as what it has: 05 and 06 as 15 and 16, and 02 and "
                "04 "
                "as 01 and 03 where the profile says that the memory is the same; not with a "
                "guard.")
            .initially("auto")
            .other("poll", "Blocks that are read again and again, for max_age.")
            .other("simulate", "Faults of the simulated panel.")
            .change_needs(kOpensPort)
            .other("points", "Values by name.");
    return kKeys;
}

const Keys<sim::Misbehaviour>& fault_keys() {
    using Faults = sim::Misbehaviour;
    static const auto kKeys =
        Keys<Faults>()
            .boolean("dead", &Faults::dead, "Neither executes nor answers.")
            .duration("slow", &Faults::slow, 0ms, 10min, "More think time.")
            .duration("late_by", &Faults::late_by, 0ms, 10min,
                      "More think time, for the share `late`.")
            .share("late", &Faults::late, "A share of its answers.")
            .share("drop", &Faults::drop, "The share that it executes and does not answer.")
            .share("damage", &Faults::damage, "The share with a wrong bit.")
            .share("truncate", &Faults::truncate, "The share that is cut in half.")
            .share("foreign_id", &Faults::foreign_id, "The share that carries another address.")
            .share("duplicate", &Faults::duplicate,
                   "The share that a second panel with this address answers, too.");
    return kKeys;
}

const Keys<points::Poll>& poll_keys() {
    using points::Poll;
    constexpr std::int64_t kLargest = 2040;  // the largest read of any panel: GT, ARCT1F501E 1.3.1
    static const auto kKeys =
        Keys<Poll>()
            .other("read", "Where it begins, as the panel names it.")
            .integer("count", &Poll::count, 1, kLargest, "Registers or bits.")
            .duration("every", &Poll::every, 1ms, points::kSlowest, "How often it is read.");
    return kKeys;
}

const Keys<points::Point>& point_keys() {
    using points::Point;
    static constexpr Words<points::WordOrder, 4> kOrders{{{"ABCD", points::kOrders[0]},
                                                          {"BADC", points::kOrders[1]},
                                                          {"CDAB", points::kOrders[2]},
                                                          {"DCBA", points::kOrders[3]}}};
    const auto or_none = [](const auto& number) { return number ? number->text() : "none"; };
    static const auto kKeys =
        Keys<Point>()
            .other("name", "Unique in the station: a-z, 0-9, '-' and '_'.")
            .other("at", "As the panel names it: UW100, 400001.",
                   [](const Point& point) { return point.at; })
            .other("bit", "One bit of a register; the point is of type bool then.",
                   [](const Point& point) {
                       return point.bit ? std::to_string(*point.bit) : std::string("none");
                   })
            .other("type", "How it is read; u16 without, of bits bool.",
                   [](const Point& point) { return std::string(label(point.type)); })
            .other("length", "Characters of a string, two in a register.",
                   [](const Point& point) { return std::to_string(point.length); })
            .word("word_order", &Point::word_order, kOrders, "ABCD: high word first.")
            .other("scale", "value = raw * scale + offset.",
                   [](const Point& point) { return number_text(point.scale); })
            .initially("1")
            .other("offset", "See scale.",
                   [](const Point& point) { return number_text(point.offset); })
            .initially("0")
            .other("unit", "As people write it.",
                   [](const Point& point) { return point.unit.empty() ? "none" : point.unit; })
            .other("min", "The least that may be written.",
                   [=](const Point& point) { return or_none(point.min); })
            .other("max", "The most that may be written.",
                   [=](const Point& point) { return or_none(point.max); })
            .boolean("writable", &Point::writable, "Clients may write it.")
            .other("labels", "Names of raw numbers: {0: off, 1: on}.")
            .other("no_value", "Raw numbers that mean that there is none.",
                   [](const Point& point) {
                       return listed(point.no_value,
                                     [](std::int64_t raw) { return std::to_string(raw); });
                   })
            .duration("every", &Point::every, 1ms, points::kSlowest, "How often it is read.");
    return kKeys;
}

}  // namespace panelgate::config
