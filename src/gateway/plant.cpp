#include "panelgate/gateway/plant.hpp"

#include <algorithm>
#include <stdexcept>

namespace panelgate::gateway {
namespace {

/// The first station that satisfies `wanted`, or null.
template <class Wanted>
const Station* first(const std::deque<Station>& stations, const Wanted& wanted) {
    const auto found = std::ranges::find_if(stations, wanted);
    return found == stations.end() ? nullptr : &*found;
}

}  // namespace

void Plant::add(const config::Line& line, bus::BusClient& bus,
                const std::shared_ptr<sim::SimulatedBus>& simulated) {
    lines_.push_back({&line, simulated != nullptr ? kSimulatedDevice : line.device.device, &bus});
    for (const config::Station& configured : line.stations) {
        Station& station = stations_.emplace_back();
        station.name = configured.name;
        station.line = line.name;
        station.id = configured.id;
        station.bus = &bus;
        station.configured = &configured;
        station.simulated = simulated;
    }
}

void Plant::add_units(const tcp_server::UnitMap& units) {
    for (int unit = 1; unit <= 255; ++unit) {
        const auto target = units.route(static_cast<std::uint8_t>(unit));
        if (!target) continue;
        const auto reached = std::ranges::find_if(stations_, [&](const Station& station) {
            return station.bus == target->bus && station.id == target->station;
        });
        if (reached != stations_.end() && !reached->unit) reached->unit = unit;
    }
}

const Station* Plant::find(std::string_view name) const {
    return first(stations_, [&](const Station& station) { return station.name == name; });
}

const Station* Plant::find(std::string_view line, std::uint8_t id) const {
    return first(stations_,
                 [&](const Station& station) { return station.line == line && station.id == id; });
}

const Station* Plant::find_unit(int unit) const {
    return first(stations_, [&](const Station& station) { return station.unit == unit; });
}

Station& Plant::at(std::string_view line, std::uint8_t id) {
    for (Station& station : stations_) {
        if (station.line == line && station.id == id) return station;
    }
    throw std::logic_error("no station " + std::to_string(id) + " on " + std::string(line));
}

std::string Plant::name_of(std::string_view line, std::uint8_t id) const {
    if (id == 0) return {};
    const Station* station = find(line, id);
    return station != nullptr ? station->name : std::to_string(id);
}

std::vector<tcp_server::LineInfo> Plant::listener_lines(explain::Unlisted unlisted) const {
    std::vector<tcp_server::LineInfo> infos;
    for (const Line& line : lines_) {
        infos.push_back(line_info(*line.configured, unlisted));
        infos.back().bus = line.bus;
    }
    infos.insert(infos.end(), images_.begin(), images_.end());
    return infos;
}

}  // namespace panelgate::gateway
