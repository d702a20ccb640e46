#include "panelgate/config/setting.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "load_tls.hpp"
#include "panelgate/config/describe.hpp"
#include "setting_writer.hpp"
#include "tables.hpp"

namespace panelgate::config {
namespace {

void show_port(const SettingWriter& port, const line::Settings& settings) {
    port_keys().show(port, settings);
    serial_keys().show(port.below("serial"), settings.serial);
    rs485_keys().show(port.below("rs485"), settings.rs485);
}

void show_point(const SettingWriter& station, const points::Point& point) {
    const SettingWriter section = station.item("points", point.name);
    point_keys().show(section, point);
    for (const auto& [raw, text] : point.labels)
        section.below("labels").put(std::to_string(raw), text);
}

/// As written: what was reckoned is `auto`.
Timing written(const arbiter::StationSettings& settings, bool automatic_gap, Duration think_time) {
    return {settings, automatic_gap ? std::nullopt : settings.frame_gap, think_time};
}

void show_station(const SettingWriter& line, const StationView& of) {
    const SettingWriter section = line.item("stations", of.station.name);
    station_keys().show(section, of, line);
    timing_keys().show(section.below("timing"),
                       written(of.settings, of.station.automatic_gap, of.station.think_time),
                       line.below("timing"));
    fault_keys().show(section.below("simulate"), of.station.faults);
    for (const points::Point& point : of.station.points) show_point(section, point);
    Distinct reads;
    for (const points::Poll& poll : of.station.polls)
        poll_keys().show(section.item("poll", reads.name(poll.read)), poll);
}

void show_line(const SettingWriter& top, const Line& line) {
    const SettingWriter section = top.item("lines", line.name);
    show_port(section, line.device);
    const bool is_ascii = line.device.serial.mode == SerialMode::ascii;
    line_serial_keys().show(section.below("serial"), line);
    line_keys().show(section, line);
    timing_keys().show(section.below("timing"),
                       written(line.arbiter.unlisted, line.automatic_gap, line.think_time));
    line_timing_keys().show(section.below("timing"), line);
    queue_keys().show(section.below("queue"), line.arbiter.queue);
    offline_keys().show(section.below("offline"), line.arbiter.offline);
    line_fault_keys().show(section.below("simulate"), line);
    for (std::size_t i = 0; i < line.stations.size(); ++i)
        show_station(section, {line.stations[i], line.arbiter.stations[i], is_ascii});
}

void show_access(const SettingWriter& section, const tcp_server::Settings& settings) {
    access_keys().show(section, settings);
    for (const auto& [unit, target] : settings.units)
        section.below("units").put(std::to_string(unit),
                                   target.line + '/' + std::to_string(target.station));
}

void show_http(const SettingWriter& top, const web::Settings& settings) {
    const SettingWriter section = top.item("http");
    http_keys().show(section, settings);
    for (const web::Token& token : settings.tokens) {
        const SettingWriter one = section.item("tokens", token.name);
        token_keys().show(one, token);
        one.put_secret("secret", token.hash);
    }
    show_tls(section, settings.tls);
}

void show_servers(const SettingWriter& top, const Config& config) {
    Distinct listeners;
    for (const tcp_server::Settings& settings : config.modbus_tcp) {
        const SettingWriter section = top.item("modbus_tcp", listeners.name(settings.name()));
        show_access(section, settings);
        listener_keys().show(section, settings);
        show_tls(section, settings.tls);
    }
    for (const serial_server::Settings& settings : config.serial_masters) {
        const SettingWriter section = top.item("serial_masters", settings.name);
        show_port(section, settings.device);
        show_access(section, settings.access);
        master_keys().show(section, settings);
    }
    if (config.http) show_http(top, *config.http);
    const SettingWriter access = top.below("access");
    rules_keys().show(access, config.access);
    for (const OwnRole& role : config.access.roles)
        own_role_keys().show(access.item("roles", role.name), role);
    for (const access::Rule& rule : config.access.rules)
        rule_keys().show(access.item("rules", rule.name), rule);
    if (config.mqtt) {
        mqtt_keys().show(top.item("mqtt"), *config.mqtt);
        if (!config.mqtt->password.empty())
            top.below("mqtt").put_secret("password", config.mqtt->password);
    }
}

/// Of the settings of one map; nullptr if it has none of that name.
Setting* named(std::span<Setting> map, std::string_view key) {
    const auto found = std::ranges::find(map, key, &Setting::key);
    return found == map.end() ? nullptr : &*found;
}

/// Finds what a file cannot have beside the values of its neighbours, which are shown together.
void find_idle(std::vector<Setting>& all) {
    std::map<std::string_view, std::vector<const yaml::KeyRule*>> rules;  // by map
    for (const yaml::KeyRule& rule : describe().rules)
        if (!rule.needs) rules[rule.map].push_back(&rule);
    for (std::size_t first = 0, end = 0; first < all.size(); first = end) {
        while (end < all.size() && all[end].map == all[first].map) ++end;
        const auto own = rules.find(all[first].map->keys);
        if (own == rules.end()) continue;
        const std::span<Setting> map = std::span(all).subspan(first, end - first);
        std::string_view asked;
        const Setting* other = nullptr;
        for (const yaml::KeyRule* rule : own->second) {
            if (std::exchange(asked, rule->other) != rule->other) other = named(map, rule->other);
            Setting* key = other == nullptr ? nullptr : named(map, rule->key);
            if (key != nullptr && std::ranges::find(rule->words, other->value) == rule->words.end())
                key->applies = false;
        }
    }
}

}  // namespace

std::string Distinct::name(const std::string& known_by) {
    const int count = ++seen_[known_by];
    return count == 1 ? known_by : known_by + " (" + std::to_string(count) + ')';
}

void each_part(const Config& config, const std::function<void(std::vector<Setting>)>& take) {
    const auto part = [&take](const auto& show) {
        std::vector<Setting> settings;
        show(SettingWriter(settings));
        find_idle(settings);
        take(std::move(settings));
    };
    part([&](const SettingWriter& top) { root_keys().show(top, config); });
    for (const Line& line : config.lines)
        part([&](const SettingWriter& top) { show_line(top, line); });
    part([&](const SettingWriter& top) {
        show_servers(top, config);
        for (const points::Relay& relay : config.relays)
            relay_keys().show(top.item("relays", relay.name()), relay);
        log_keys().show(top.below("log"), config.log);
        realtime_keys().show(top.below("realtime"), config.realtime);
        if (config.audit) audit_keys().show(top.below("audit"), *config.audit);
    });
}

std::vector<Setting> all_settings(const Config& config) {
    std::vector<Setting> all;
    each_part(config,
              [&](std::vector<Setting> part) { std::ranges::move(part, std::back_inserter(all)); });
    return all;
}

}  // namespace panelgate::config
