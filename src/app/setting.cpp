#include "setting.hpp"

#include <array>
#include <optional>

#include "panelgate/base/decimal.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::app {

void SettingWriter::put(std::string_view key, Duration value) {
    add(key, yaml::format_duration(value), "");
}

void SettingWriter::put_secret(std::string_view key, std::string value) {
    settings_->push_back({at(key), std::move(value), true, ""});
}

SettingWriter SettingWriter::item(std::string_view key) const {
    settings_->push_back({at(key), "", false, ""});
    return below(key);
}

std::string Distinct::name(const std::string& known_by) {
    const int count = ++seen_[known_by];
    return count == 1 ? known_by : known_by + " (" + std::to_string(count) + ')';
}

std::vector<Setting> all_settings(const config::Config& config) {
    std::vector<Setting> all;
    const SettingWriter top(all, "");
    for (const config::Line& line : config.lines) add_settings_of_line(top, line);
    add_settings_of_servers(top, config);
    constexpr std::array<const char*, 5> kLevels{"error", "warn", "info", "debug", "trace"};
    SettingWriter log = top.below("log");
    log.put("level", kLevels[static_cast<std::size_t>(config.log.level)]);
    log.put("format", config.log.format == rt::LogFormat::json ? "json" : "text");
    SettingWriter realtime = top.below("realtime");
    realtime.put("priority", config.realtime.priority);
    realtime.put("lock_memory", config.realtime.lock_memory);
    return all;
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

/// The timing that lines and stations share; a station inherits from its line, `owner`.
void add_settings_of_timing(SettingWriter& timing, const arbiter::StationSettings& settings,
                            const SettingWriter& owner) {
    timing.put("response_timeout", timeout_text(settings), owner);
    timing.put("frame_gap", or_auto(settings.frame_gap), owner);
    timing.put("late_window", or_auto(settings.late_window), owner);
}

void add_settings_of_faults(const SettingWriter& station, const sim::Misbehaviour& faults) {
    SettingWriter simulate = station.below("simulate");
    simulate.put("dead", faults.dead);
    simulate.put("slow", faults.slow);
    simulate.put("late_by", faults.late_by);
    simulate.put("late", number_text(faults.late));
    simulate.put("drop", number_text(faults.drop));
    simulate.put("damage", number_text(faults.damage));
    simulate.put("truncate", number_text(faults.truncate));
    simulate.put("foreign_id", number_text(faults.foreign_id));
    simulate.put("duplicate", number_text(faults.duplicate));
}

std::string or_none(const std::optional<Decimal>& number) {
    return number ? number->text() : "none";
}

void add_settings_of_point(const SettingWriter& station, const points::Point& point) {
    SettingWriter section = station.item("points", point.name);
    section.put("at", point.at);
    section.put("bit", point.bit ? std::to_string(*point.bit) : "none");
    section.put("type", label(point.type));
    section.put("word_order", label(point.word_order));
    section.put("length", std::size_t{point.length});
    section.put("scale", number_text(point.scale));
    section.put("offset", number_text(point.offset));
    section.put("unit", point.unit.empty() ? "none" : point.unit);
    section.put("min", or_none(point.min));
    section.put("max", or_none(point.max));
    section.put("writable", point.writable);
    section.put("every", point.every);
    SettingWriter labels = section.below("labels");
    for (const auto& [raw, text] : point.labels) labels.put(std::to_string(raw), text);
    std::string none;
    for (const std::int64_t raw : point.no_value)
        none += (none.empty() ? "" : ", ") + std::to_string(raw);
    section.put("no_value", '[' + none + ']');
}

void add_settings_of_station(const SettingWriter& line, const config::Station& station,
                             const arbiter::StationSettings& settings) {
    SettingWriter section = line.item("stations", station.name);
    section.put("id", std::size_t{station.id});
    section.put("profile", station.profile->name);
    section.put("access", station.read_only ? "read_only" : "read_write");
    section.put("guard", station.guard);
    section.put("translate", station.translate ? "auto" : "off");
    section.put("crc_order", label(settings.crc_order));
    section.put("retries", std::to_string(settings.retries), line);
    section.put("retry_writes", settings.retry_writes);
    section.put("max_age", settings.max_age);
    SettingWriter timing = section.below("timing");
    add_settings_of_timing(timing, settings, line.below("timing"));
    timing.put("think_time", station.think_time);
    add_settings_of_faults(section, station.faults);
    for (const points::Point& point : station.points) add_settings_of_point(section, point);
    Distinct reads;
    for (const points::Poll& poll : station.polls) {
        SettingWriter read = section.item("poll", reads.name(poll.read));
        read.put("count", std::size_t{poll.count});
        read.put("every", poll.every);
    }
}

void add_settings_of_line_timing(const SettingWriter& line, const arbiter::Settings& settings) {
    SettingWriter timing = line.below("timing");
    add_settings_of_timing(timing, settings.unlisted, timing);
    timing.put("reply_hole", settings.reply_hole);
    timing.put("broadcast_turnaround", settings.broadcast_turnaround);
}

void add_settings_of_queue(const SettingWriter& line, const arbiter::Settings& settings) {
    SettingWriter queue = line.below("queue");
    queue.put("limit", settings.queue.limit);
    queue.put("per_client", settings.queue.per_client);
    queue.put("deadline", settings.queue.deadline);
    SettingWriter offline = line.below("offline");
    offline.put("after", settings.offline.after);
    offline.put("probe_min", settings.offline.probe_min);
    offline.put("probe_max", settings.offline.probe_max);
}

}  // namespace

void add_settings_of_port(SettingWriter& port, const line::Settings& settings) {
    port.put("device", settings.device);
    SettingWriter serial = port.below("serial");
    serial.put("mode", settings.serial.mode == SerialMode::ascii ? "ascii" : "rtu");
    serial.put("baud", settings.serial.baud);
    serial.put("data_bits", settings.serial.data_bits);
    serial.put("parity", to_string(settings.serial.parity));
    serial.put("stop_bits", settings.serial.stop_bits);
    constexpr std::array<const char*, 3> kModes{"off", "kernel", "rts"};
    SettingWriter rs485 = port.below("rs485");
    rs485.put("mode", kModes[static_cast<std::size_t>(settings.rs485.mode)]);
    rs485.put("rts_on_send", settings.rs485.rts_high_on_send ? "high" : "low");
    rs485.put("delay_before_send", settings.rs485.delay_before_send);
    rs485.put("delay_after_send", settings.rs485.delay_after_send);
    rs485.put("receive_during_send", settings.rs485.receive_during_send);
}

void add_settings_of_line(const SettingWriter& top, const config::Line& line) {
    constexpr std::array<const char*, 3> kEcho{"auto", "on", "off"};
    constexpr std::array<const char*, 3> kQuarantine{"auto", "line", "station"};
    SettingWriter section = top.item("lines", line.name);
    add_settings_of_port(section, line.device);
    section.put("mode", line.listens ? "listen" : "master");
    const bool any_case = line.arbiter.ascii_digits == modbus::HexDigits::any_case;
    section.below("serial").put("ascii_lower_case", any_case ? "take" : "refuse");
    section.put("echo", kEcho[static_cast<std::size_t>(line.arbiter.echo)]);
    section.put("quarantine", kQuarantine[static_cast<std::size_t>(line.arbiter.quarantine)]);
    section.put("unlisted_stations", line.refuse_unlisted ? "refuse" : "pass");
    section.put("retries", line.arbiter.unlisted.retries);
    add_settings_of_line_timing(section, line.arbiter);
    add_settings_of_queue(section, line.arbiter);
    section.below("simulate").put("echo", line.simulated_echo);
    for (std::size_t i = 0; i < line.stations.size(); ++i)
        add_settings_of_station(section, line.stations[i], line.arbiter.stations[i]);
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

/// The access settings that listeners and serial masters share.
void add_settings_of_access(SettingWriter& section, const tcp_server::Settings& settings) {
    constexpr std::array<const char*, 3> kBroadcast{"reply", "silent", "deny"};
    section.put("lines", listed(settings.lines, word));
    SettingWriter units = section.below("units");
    for (const auto& [unit, target] : settings.units)
        units.put(std::to_string(unit), target.line + '/' + std::to_string(target.station));
    section.put("access", settings.read_only ? "read_only" : "read_write");
    section.put("framing", modbus::label(settings.framing));
    section.put("broadcast", kBroadcast[static_cast<std::size_t>(settings.broadcast)]);
}

void add_settings_of_listener(const SettingWriter& top, const std::string& name,
                              const tcp_server::Settings& settings) {
    constexpr std::array<const char*, 3> kRetransmissions{"join writes", "join", "pass"};
    SettingWriter section = top.item("modbus_tcp", name);
    add_settings_of_access(section, settings);
    const bool any_case = settings.ascii_digits == modbus::HexDigits::any_case;
    section.put("ascii_lower_case", any_case ? "take" : "refuse");
    section.put("udp", settings.udp);
    section.put("retransmissions",
                kRetransmissions[static_cast<std::size_t>(settings.retransmissions)]);
    const auto& unit = settings.diagnostics_unit;
    section.put("diagnostics_unit", unit ? std::to_string(*unit) : "null");
    section.put("allow", networks(settings.allow));
    section.put("max_connections", settings.max_connections);
    section.put("max_connections_per_address", settings.max_connections_per_address);
}

void add_settings_of_master(const SettingWriter& top, const serial_server::Settings& settings) {
    constexpr std::array<const char*, 3> kEcho{"auto", "on", "off"};
    const bool silent = settings.on_failure == serial_server::OnFailure::silence;
    SettingWriter section = top.item("serial_masters", settings.name);
    add_settings_of_port(section, settings.device);
    add_settings_of_access(section, settings.access);
    section.put("on_failure", silent ? "silence" : "exception");
    section.put("echo", kEcho[static_cast<std::size_t>(settings.echo)]);
    const auto& timeout = settings.response_timeout;
    section.put("response_timeout", timeout ? yaml::format_duration(*timeout) : "none");
}

void add_settings_of_http(const SettingWriter& top, const web::Settings& settings) {
    SettingWriter section = top.item("http");
    section.put("listen", settings.name());
    section.put("anonymous", label(settings.anonymous));
    section.put("hosts", settings.hosts.empty() ? "the machine's" : listed(settings.hosts, word));
    section.put("allow", networks(settings.allow));
    section.put("max_connections_per_address", settings.max_connections_per_address);
    for (const web::Token& token : settings.tokens) {
        SettingWriter one = section.item("tokens", token.name);
        one.put("role", label(token.role));
        one.put_secret("secret", token.secret);
    }
}

void add_settings_of_mqtt(const SettingWriter& top, const mqtt::Settings& settings) {
    const auto or_default = [](const std::string& text) {
        return text.empty() ? std::string("default") : text;
    };
    SettingWriter section = top.item("mqtt");
    section.put("broker", settings.broker());
    section.put("format", label(settings.format));
    section.put("topic", settings.topic);
    section.put("group", or_default(settings.group));
    section.put("node", or_default(settings.node));
    section.put("client_id", or_default(settings.client_id));
    section.put("username", or_default(settings.username));
    section.put_secret("password", settings.password);
    section.put("write", settings.write ? "points" : "none");
    section.put("qos", settings.qos);
    section.put("keep_alive", settings.keep_alive);
    section.put("ca", or_default(settings.ca));
    section.put("certificate", or_default(settings.certificate));
    section.put("key", or_default(settings.key));
    section.put("store", settings.store);
}

}  // namespace

void add_settings_of_servers(const SettingWriter& top, const config::Config& config) {
    Distinct listeners;
    for (const tcp_server::Settings& settings : config.modbus_tcp)
        add_settings_of_listener(top, listeners.name(settings.name()), settings);
    for (const serial_server::Settings& settings : config.serial_masters)
        add_settings_of_master(top, settings);
    if (config.http) add_settings_of_http(top, *config.http);
    if (config.mqtt) add_settings_of_mqtt(top, *config.mqtt);
    for (const points::Relay& relay : config.relays) {
        SettingWriter section = top.item("relays", relay.name());
        section.put("count", std::size_t{relay.count});
        section.put("every", relay.every);
        section.put("on_change", relay.on_change);
        section.put("refresh", relay.refresh);
    }
}

}  // namespace panelgate::app
