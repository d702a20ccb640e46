#include "panelgate/explain/translations.hpp"

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/mqtt/home_assistant.hpp"
#include "panelgate/profile/judge.hpp"

namespace panelgate::explain {

namespace {

std::optional<bus::Rule> rule_of(profile::Judgement judgement) {
    switch (judgement) {
        case profile::Judgement::fine:
            return std::nullopt;
        case profile::Judgement::illegal_function:
            return bus::Rule::function;
        case profile::Judgement::illegal_value:
            return bus::Rule::quantity;
        case profile::Judgement::illegal_address:
            return bus::Rule::range;
        case profile::Judgement::write_protected:
            return bus::Rule::write_protected;
    }
    std::abort();
}

/// A guard that refuses what the panel's manual rules out.
bus::Guard guard_of(const profile::ProfileRef& panel) {
    return [panel](const modbus::Request& request) -> std::optional<bus::Objection> {
        const auto rule = rule_of(profile::judge(*panel, request));
        if (!rule) return std::nullopt;
        return bus::Objection{*rule, profile::explain(*panel, request)};
    };
}

void add_translation(bus::StationSettings& station, const profile::ProfileRef& panel) {
    for (const profile::Translation& possible : profile::translations(*panel)) {
        station.translations.emplace_back(possible.asked, possible.sent);
        station.functions.push_back(possible.asked);
    }
    if (station.translations.empty()) return;
    station.translate = [panel](const modbus::Request& request) {
        return profile::translate(*panel, request);
    };
}

/// The functions of the panel that read and write values.
std::vector<std::uint8_t> functions_of(const profile::PanelProfile& profile) {
    std::vector<std::uint8_t> functions{1, 2, 3, 4, 5, 6, 15, 16};
    std::erase_if(functions, [&](std::uint8_t code) { return !profile.has_function(code); });
    return functions;
}

const arbiter::StationSettings& station_settings(const config::Line& line, std::uint8_t station) {
    const auto& listed = line.arbiter.stations;
    const auto own = std::ranges::find(listed, station, &arbiter::StationSettings::id);
    return own == listed.end() ? line.arbiter.unlisted : *own;
}

Duration frame_gap(const config::Line& line, std::uint8_t station) {
    return station_settings(line, station).frame_gap.value_or(silent_interval(line.device.serial));
}

}  // namespace

bus::Settings bus_settings(const config::Line& line) {
    bus::Settings settings;
    settings.name = line.name;
    settings.device = line.device.device;
    settings.arbiter = line.arbiter;
    settings.access = line.access.rules;
    for (const config::Station& station : line.stations) {
        bus::StationSettings& made = settings.stations[station.id];
        made.name = station.name;
        made.access = station.read_only ? bus::Access::read_only : bus::Access::read_write;
        made.functions = functions_of(*station.profile);
        if (station.guard) made.guard = guard_of(station.profile);
        if (station.translate && !station.guard) add_translation(made, station.profile);
        made.any_length = station_settings(line, station.id).any_length;
    }
    return settings;
}

std::vector<points::PolledStation> polled_stations(const config::Line& line) {
    std::vector<points::PolledStation> polled;
    for (const config::Station& station : line.stations) {
        if (station.points.empty() && station.polls.empty()) continue;
        points::PolledStation& entry = polled.emplace_back();
        entry.id = station.id;
        entry.name = station.name;
        entry.wants = points::wants_of(station.points, station.polls);
        entry.limits = points::make_plan_limits(*station.profile, line.device.serial,
                                                frame_gap(line, station.id));
        entry.limits.think_time = station.think_time;
        entry.memory = memory_of(station.profile);
    }
    return polled;
}

points::SharedMemory memory_of(const profile::ProfileRef& panel) {
    points::SharedMemory memory;
    memory.shown_as = [panel](const modbus::Span& written) {
        return profile::shown_as(*panel, written);
    };
    memory.known = panel->name != "generic";  // which describes no particular panel
    return memory;
}

bool takes_multiple(const profile::PanelProfile& panel, modbus::Table table) {
    return panel.has_function(modbus::is_bit_table(table) ? modbus::kWriteMultipleCoils
                                                          : modbus::kWriteMultipleRegisters);
}

bool is_simulated(const config::Line& line, bool simulate) {
    return simulate || line.kind == config::Line::Kind::simulated;
}

namespace {

/// True if both lines simulate the same panels, in whatever order they are written.
bool plays_alike(const config::Line& before, const config::Line& now) {
    const auto is_there = [&](const config::Station& one) {
        const auto other = std::ranges::find(before.stations, one.id, &config::Station::id);
        return other != before.stations.end() && *one.profile == *other->profile &&
               one.faults == other->faults;
    };
    return before.simulated_echo == now.simulated_echo &&
           before.stations.size() == now.stations.size() &&
           std::ranges::all_of(now.stations, is_there);
}

}  // namespace

std::string wire_of(const config::Line& line) {
    if (line.kind != config::Line::Kind::serial) return line.device.device;
    std::error_code unknown;
    const auto path = std::filesystem::weakly_canonical(line.device.device, unknown);
    return unknown ? line.device.device : path.string();
}

bool is_same_wire(const config::Line& before, const config::Line& now, bool simulate) {
    return before.kind == now.kind && before.device == now.device && before.second == now.second &&
           before.listens == now.listens && arbiter::is_same_wire(before.arbiter, now.arbiter) &&
           (!is_simulated(now, simulate) || plays_alike(before, now));
}

WhoRef client_of(const mqtt::Settings& settings) {
    return make_who({.face = Face::mqtt,
                     .name = "mqtt",
                     .listener = settings.broker(),
                     .standing = Role::operator_,
                     .user = settings.username});
}

mqtt::Subjects subjects_of(const config::Config& config) {
    mqtt::Subjects subjects;
    const BrokerSight sight(config);
    std::vector<const config::Station*> stations;
    for (const config::Line* line : by_name(config.lines)) {
        if (sight.line(*line)) subjects.add_line(line->name);
        for (const config::Station& station : line->stations)
            if (sight.station(station)) stations.push_back(&station);
    }
    sort_by_name(stations);
    for (const config::Station* station : stations) {
        subjects.add_station(station->name);
        for (const points::Point* point : by_name(station->points))
            if (sight.point(*station, *point)) subjects.add_point(*point);
    }
    if (config.mqtt->format != mqtt::Format::json) return subjects;
    for (const alarms::Settings* alarm : by_name(config.alarms))
        if (sight.alarm(config, *alarm)) subjects.add_alarm(alarm->name);
    if (!config.mqtt->home_assistant) return subjects;
    for (const config::Station* station : stations) {
        mqtt::HomeStation home{station->name, station->profile->name};
        for (const points::Point* point : by_name(station->points))
            if (sight.point(*station, *point)) home.points.push_back(point);
        if (home.points.empty()) continue;
        mqtt::Notice notice = mqtt::home_assistant_notice(*config.mqtt, home);
        subjects.add_notice(std::move(notice.topic), std::move(notice.payload));
    }
    return subjects;
}

bool BrokerSight::alarm(const config::Config& config, const alarms::Settings& one) const {
    for (const config::Line& on : config.lines) {
        if (on.name == one.line) return line(on);
        for (const config::Station& with : on.stations) {
            if (with.name != one.station) continue;
            const auto found = std::ranges::find(with.points, one.point, &points::Point::name);
            return found == with.points.end() ? station(with) : point(with, *found);
        }
    }
    return sees_all(config);
}

bool is_same_session(const config::Config& before, const config::Config& now) {
    return before.mqtt == now.mqtt && (!now.mqtt || subjects_of(before) == subjects_of(now));
}

}  // namespace panelgate::explain
