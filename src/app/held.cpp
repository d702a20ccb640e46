#include "held.hpp"

#include <array>
#include <optional>

#include "panelgate/base/decimal.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::app {

void Holder::tell(std::string_view key, Duration value) {
    add(key, yaml::format_duration(value), "");
}

void Holder::tell_secret(std::string_view key, std::string value) {
    held_->push_back({at(key), std::move(value), true, ""});
}

Holder Holder::item(std::string_view key) const {
    held_->push_back({at(key), "", false, ""});
    return below(key);
}

std::string Distinct::name(const std::string& known_by) {
    const int count = ++seen_[known_by];
    return count == 1 ? known_by : known_by + " (" + std::to_string(count) + ')';
}

std::vector<Held> all_held(const config::Config& config) {
    std::vector<Held> held;
    const Holder top(held, "");
    for (const config::Line& line : config.lines) hold_line(top, line);
    hold_servers(top, config);
    constexpr std::array<const char*, 5> kLevels{"error", "warn", "info", "debug", "trace"};
    Holder log = top.below("log");
    log.tell("level", kLevels[static_cast<std::size_t>(config.log.level)]);
    log.tell("format", config.log.format == rt::LogFormat::json ? "json" : "text");
    Holder realtime = top.below("realtime");
    realtime.tell("priority", config.realtime.priority);
    realtime.tell("lock_memory", config.realtime.lock_memory);
    return held;
}

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

namespace {

template <class List, class Word>
std::string listed(const List& list, const Word& word) {
    std::string text;
    for (const auto& one : list) text += (text.empty() ? "" : ", ") + word(one);
    return '[' + text + ']';
}

std::string word(const std::string& text) { return text; }

std::string networks(const std::vector<Network>& allow) {
    if (allow.empty()) return "all";
    return listed(allow, [](const Network& network) {
        return network.address + '/' + std::to_string(network.prefix);
    });
}

/// What listeners and serial masters have.
void hold_access(Holder& held, const tcp_server::Settings& settings) {
    constexpr std::array<const char*, 3> kBroadcast{"reply", "silent", "deny"};
    held.tell("lines", listed(settings.lines, word));
    Holder units = held.below("units");
    for (const auto& [unit, target] : settings.units)
        units.tell(std::to_string(unit), target.line + '/' + std::to_string(target.station));
    held.tell("access", settings.read_only ? "read_only" : "read_write");
    held.tell("framing", modbus::label(settings.framing));
    held.tell("broadcast", kBroadcast[static_cast<std::size_t>(settings.broadcast)]);
}

void hold_listener(const Holder& top, const std::string& name,
                   const tcp_server::Settings& settings) {
    constexpr std::array<const char*, 3> kRetransmissions{"join writes", "join", "pass"};
    Holder held = top.item("modbus_tcp", name);
    hold_access(held, settings);
    const bool any_case = settings.ascii_digits == modbus::HexDigits::any_case;
    held.tell("ascii_lower_case", any_case ? "take" : "refuse");
    held.tell("udp", settings.udp);
    held.tell("retransmissions",
              kRetransmissions[static_cast<std::size_t>(settings.retransmissions)]);
    const auto& unit = settings.diagnostics_unit;
    held.tell("diagnostics_unit", unit ? std::to_string(*unit) : "null");
    held.tell("allow", networks(settings.allow));
    held.tell("max_connections", settings.max_connections);
    held.tell("max_connections_per_address", settings.max_connections_per_address);
}

void hold_master(const Holder& top, const serial_server::Settings& settings) {
    constexpr std::array<const char*, 3> kEcho{"auto", "on", "off"};
    const bool silent = settings.on_failure == serial_server::OnFailure::silence;
    Holder held = top.item("serial_masters", settings.name);
    hold_port(held, settings.device);
    hold_access(held, settings.access);
    held.tell("on_failure", silent ? "silence" : "exception");
    held.tell("echo", kEcho[static_cast<std::size_t>(settings.echo)]);
    const auto& timeout = settings.response_timeout;
    held.tell("response_timeout", timeout ? yaml::format_duration(*timeout) : "none");
}

void hold_http(const Holder& top, const web::Settings& settings) {
    Holder held = top.item("http");
    held.tell("listen", settings.name());
    held.tell("anonymous", label(settings.anonymous));
    held.tell("hosts", settings.hosts.empty() ? "the machine's" : listed(settings.hosts, word));
    held.tell("allow", networks(settings.allow));
    held.tell("max_connections_per_address", settings.max_connections_per_address);
    for (const web::Token& token : settings.tokens) {
        Holder one = held.item("tokens", token.name);
        one.tell("role", label(token.role));
        one.tell_secret("secret", token.secret);
    }
}

void hold_mqtt(const Holder& top, const mqtt::Settings& settings) {
    const auto or_default = [](const std::string& text) {
        return text.empty() ? std::string("default") : text;
    };
    Holder held = top.item("mqtt");
    held.tell("broker", settings.broker());
    held.tell("format", label(settings.format));
    held.tell("topic", settings.topic);
    held.tell("group", or_default(settings.group));
    held.tell("node", or_default(settings.node));
    held.tell("client_id", or_default(settings.client_id));
    held.tell("username", or_default(settings.username));
    held.tell_secret("password", settings.password);
    held.tell("write", settings.write ? "points" : "none");
    held.tell("qos", settings.qos);
    held.tell("keep_alive", settings.keep_alive);
    held.tell("ca", or_default(settings.ca));
    held.tell("certificate", or_default(settings.certificate));
    held.tell("key", or_default(settings.key));
    held.tell("store", settings.store);
}

}  // namespace

void hold_servers(const Holder& top, const config::Config& config) {
    Distinct listeners;
    for (const tcp_server::Settings& settings : config.modbus_tcp)
        hold_listener(top, listeners.name(settings.name()), settings);
    for (const serial_server::Settings& settings : config.serial_masters)
        hold_master(top, settings);
    if (config.http) hold_http(top, *config.http);
    if (config.mqtt) hold_mqtt(top, *config.mqtt);
    for (const points::Relay& relay : config.relays) {
        Holder held = top.item("relays", relay.name());
        held.tell("count", std::size_t{relay.count});
        held.tell("every", relay.every);
        held.tell("on_change", relay.on_change);
        held.tell("refresh", relay.refresh);
    }
}

}  // namespace panelgate::app
