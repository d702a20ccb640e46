#include "own_state.hpp"

#include <algorithm>
#include <cstddef>

#include "panelgate/bus/bus_client.hpp"

namespace panelgate::tcp_server {
namespace {

std::optional<Diagnostics::Station> station_of(std::uint8_t unit, const UnitMap& units) {
    const Result<Target> target = units.route(unit);
    if (!target || !units.is_listed(unit)) return std::nullopt;
    const bus::StationStatus status = target->bus->station_status(target->station);
    const auto& lines = units.lines();
    const auto line = std::ranges::find(lines, target->bus);
    Diagnostics::Station station;
    station.state = status.state;
    station.id = target->station;
    station.last_answer = status.last_success;
    station.outcomes = target->bus->outcomes(target->station);
    if (line != lines.end()) station.line = static_cast<std::size_t>(line - lines.begin());
    return station;
}

}  // namespace

Diagnostics own_state(const Shared& shared) {
    Diagnostics state;
    state.uptime = shared.clock.now() - shared.started;
    state.counters = shared.counters;
    state.version = shared.version;
    state.url = shared.settings.url;
    state.host = shared.settings.host;
    for (const bus::BusClient* line : shared.units.lines()) {
        const bus::LineStatus status = line->status();
        state.lines.push_back({status.name, status.up, status.queue_depth, status.load_percent});
    }
    state.station = [&shared](std::uint8_t unit) { return station_of(unit, shared.units); };
    return state;
}

}  // namespace panelgate::tcp_server
