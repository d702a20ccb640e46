#include <array>
#include <optional>

#include "held.hpp"
#include "panelgate/base/decimal.hpp"
#include "panelgate/base/number_text.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::app {
namespace {

using yaml::format_duration;

std::string timeout_text(const arbiter::StationSettings& settings) {
    const std::string longest = format_duration(settings.response_timeout);
    if (!settings.adaptive_timeout) return longest;
    return "adaptive, " + format_duration(settings.timeout_floor) + " to " + longest;
}

std::string or_auto(std::optional<Duration> duration) {
    return duration ? format_duration(*duration) : "auto";
}

/// What a line and its stations have: those of a station, where `owner` is its line.
void hold_timing(Holder& timing, const arbiter::StationSettings& settings, const Holder& owner) {
    timing.tell("response_timeout", timeout_text(settings), owner);
    timing.tell("frame_gap", or_auto(settings.frame_gap), owner);
    timing.tell("late_window", or_auto(settings.late_window), owner);
}

void hold_faults(const Holder& station, const sim::Misbehaviour& faults) {
    Holder simulate = station.below("simulate");
    simulate.tell("dead", faults.dead);
    simulate.tell("slow", faults.slow);
    simulate.tell("late_by", faults.late_by);
    simulate.tell("late", number_text(faults.late));
    simulate.tell("drop", number_text(faults.drop));
    simulate.tell("damage", number_text(faults.damage));
    simulate.tell("truncate", number_text(faults.truncate));
    simulate.tell("foreign_id", number_text(faults.foreign_id));
    simulate.tell("duplicate", number_text(faults.duplicate));
}

std::string or_none(const std::optional<Decimal>& number) {
    return number ? number->text() : "none";
}

void hold_point(const Holder& station, const points::Point& point) {
    Holder held = station.item("points", point.name);
    held.tell("at", point.at);
    held.tell("bit", point.bit ? std::to_string(*point.bit) : "none");
    held.tell("type", label(point.type));
    held.tell("word_order", label(point.word_order));
    held.tell("length", std::size_t{point.length});
    held.tell("scale", number_text(point.scale));
    held.tell("offset", number_text(point.offset));
    held.tell("unit", point.unit.empty() ? "none" : point.unit);
    held.tell("min", or_none(point.min));
    held.tell("max", or_none(point.max));
    held.tell("writable", point.writable);
    held.tell("every", point.every);
    Holder labels = held.below("labels");
    for (const auto& [raw, text] : point.labels) labels.tell(std::to_string(raw), text);
    std::string none;
    for (const std::int64_t raw : point.no_value)
        none += (none.empty() ? "" : ", ") + std::to_string(raw);
    held.tell("no_value", '[' + none + ']');
}

void hold_station(const Holder& line, const config::Station& station,
                  const arbiter::StationSettings& settings) {
    Holder held = line.item("stations", station.name);
    held.tell("id", std::size_t{station.id});
    held.tell("profile", station.profile->name);
    held.tell("access", station.read_only ? "read_only" : "read_write");
    held.tell("guard", station.guard);
    held.tell("translate", station.translate ? "auto" : "off");
    held.tell("crc_order", label(settings.crc_order));
    held.tell("retries", std::to_string(settings.retries), line);
    held.tell("retry_writes", settings.retry_writes);
    held.tell("max_age", settings.max_age);
    Holder timing = held.below("timing");
    hold_timing(timing, settings, line.below("timing"));
    timing.tell("think_time", station.think_time);
    hold_faults(held, station.faults);
    for (const points::Point& point : station.points) hold_point(held, point);
    Distinct reads;
    for (const points::Poll& poll : station.polls) {
        Holder read = held.item("poll", reads.name(poll.read));
        read.tell("count", std::size_t{poll.count});
        read.tell("every", poll.every);
    }
}

void hold_line_timing(const Holder& line, const arbiter::Settings& settings) {
    Holder timing = line.below("timing");
    hold_timing(timing, settings.unlisted, timing);
    timing.tell("reply_hole", settings.reply_hole);
    timing.tell("broadcast_turnaround", settings.broadcast_turnaround);
}

void hold_queue(const Holder& line, const arbiter::Settings& settings) {
    Holder queue = line.below("queue");
    queue.tell("limit", settings.queue.limit);
    queue.tell("per_client", settings.queue.per_client);
    queue.tell("deadline", settings.queue.deadline);
    Holder offline = line.below("offline");
    offline.tell("after", settings.offline.after);
    offline.tell("probe_min", settings.offline.probe_min);
    offline.tell("probe_max", settings.offline.probe_max);
}

}  // namespace

void hold_port(Holder& port, const line::Settings& settings) {
    port.tell("device", settings.device);
    Holder serial = port.below("serial");
    serial.tell("mode", settings.serial.mode == SerialMode::ascii ? "ascii" : "rtu");
    serial.tell("baud", settings.serial.baud);
    serial.tell("data_bits", settings.serial.data_bits);
    serial.tell("parity", to_string(settings.serial.parity));
    serial.tell("stop_bits", settings.serial.stop_bits);
    constexpr std::array<const char*, 3> kModes{"off", "kernel", "rts"};
    Holder rs485 = port.below("rs485");
    rs485.tell("mode", kModes[static_cast<std::size_t>(settings.rs485.mode)]);
    rs485.tell("rts_on_send", settings.rs485.rts_high_on_send ? "high" : "low");
    rs485.tell("delay_before_send", settings.rs485.delay_before_send);
    rs485.tell("delay_after_send", settings.rs485.delay_after_send);
    rs485.tell("receive_during_send", settings.rs485.receive_during_send);
}

void hold_line(const Holder& top, const config::Line& line) {
    constexpr std::array<const char*, 3> kEcho{"auto", "on", "off"};
    constexpr std::array<const char*, 3> kQuarantine{"auto", "line", "station"};
    Holder held = top.item("lines", line.name);
    hold_port(held, line.device);
    held.tell("mode", line.listens ? "listen" : "master");
    const bool any_case = line.arbiter.ascii_digits == modbus::HexDigits::any_case;
    held.below("serial").tell("ascii_lower_case", any_case ? "take" : "refuse");
    held.tell("echo", kEcho[static_cast<std::size_t>(line.arbiter.echo)]);
    held.tell("quarantine", kQuarantine[static_cast<std::size_t>(line.arbiter.quarantine)]);
    held.tell("unlisted_stations", line.refuse_unlisted ? "refuse" : "pass");
    held.tell("retries", line.arbiter.unlisted.retries);
    hold_line_timing(held, line.arbiter);
    hold_queue(held, line.arbiter);
    held.below("simulate").tell("echo", line.simulated_echo);
    for (std::size_t i = 0; i < line.stations.size(); ++i)
        hold_station(held, line.stations[i], line.arbiter.stations[i]);
}

}  // namespace panelgate::app
