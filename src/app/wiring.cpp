#include "wiring.hpp"

#include <cstdlib>
#include <optional>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/judge.hpp"
#include "panelgate/profile/shown_as.hpp"
#include "panelgate/profile/translate.hpp"

namespace panelgate::app {
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

/// Refuses what the panel's manual rules out.
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

/// Of the functions that read and write values, those that the panel has.
std::vector<std::uint8_t> functions_of(const profile::PanelProfile& profile) {
    std::vector<std::uint8_t> functions{1, 2, 3, 4, 5, 6, 15, 16};
    std::erase_if(functions, [&](std::uint8_t code) { return !profile.has_function(code); });
    return functions;
}

Duration frame_gap(const config::Line& line, std::uint8_t station) {
    std::optional<Duration> gap = line.arbiter.unlisted.frame_gap;
    for (const arbiter::StationSettings& settings : line.arbiter.stations) {
        if (settings.id == station) gap = settings.frame_gap;
    }
    return gap.value_or(silent_interval(line.device.serial));
}

}  // namespace

bus::Settings bus_settings(const config::Line& line) {
    bus::Settings settings;
    settings.name = line.name;
    settings.device = line.device.device;
    settings.arbiter = line.arbiter;
    for (const config::Station& station : line.stations) {
        bus::StationSettings& made = settings.stations[station.id];
        made.name = station.name;
        made.access = station.read_only ? bus::Access::read_only : bus::Access::read_write;
        made.functions = functions_of(*station.profile);
        if (station.guard) made.guard = guard_of(station.profile);
        if (station.translate && !station.guard) add_translation(made, station.profile);
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
    memory.known = panel->name != "generic";  // which says what anybody could
    return memory;
}

bool takes_multiple(const profile::PanelProfile& panel, modbus::Table table) {
    return panel.has_function(modbus::is_bit_table(table) ? modbus::kWriteMultipleCoils
                                                          : modbus::kWriteMultipleRegisters);
}

points::RelayRoute route_of(const Plant& plant, const points::Relay& relay) {
    const Station& from = *plant.find(relay.from.station);
    const Station& to = *plant.find(relay.to.station);
    points::RelayRoute route;
    route.relay = relay;
    route.from = from.bus;
    route.from_station = from.id;
    route.to = to.bus;
    route.to_station = to.id;
    route.to_line = to.line;
    route.to_memory = memory_of(to.configured->profile);
    route.to_has_multiple = takes_multiple(*to.configured->profile, relay.to.table);
    return route;
}

}  // namespace panelgate::app
