#include "panelgate/tcp_server/unit_map.hpp"

#include <algorithm>
#include <stdexcept>

#include "panelgate/modbus/function.hpp"

namespace panelgate::tcp_server {

UnitMap::UnitMap(const Settings& settings, const std::vector<LineInfo>& lines) {
    for (const LineInfo& line : lines) lines_.push_back({line.name, line.bus});
    for (const auto& [unit, target] : settings.units)
        aliases_[unit] = Place{index_of(target.line), target.station};
    for (const std::string& name : settings.lines) own_.push_back(index_of(name));
    const bool all = own_.empty();
    for (std::size_t i = 0; i < lines.size(); ++i) {
        if (!lines[i].shows) {
            if (all) own_.push_back(i);
        } else if (settings.serves_all(*lines[i].shows)) {
            add_stations(i, lines[i].stations);
        }
    }
    for (const std::size_t line : own_) add_stations(line, lines[line].stations);
    if (own_.size() != 1 || !lines[own_.front()].pass_unlisted) return;
    for (std::uint8_t station = 1; station <= modbus::kMaxStation; ++station) {
        if (!listed_[station]) direct_[station] = Place{own_.front(), station};
    }
}

std::size_t UnitMap::index_of(const std::string& line) const {
    const auto at = std::ranges::find(lines_, line, &RoutedLine::name);
    if (at == lines_.end()) throw std::invalid_argument("no line is called \"" + line + "\"");
    return static_cast<std::size_t>(at - lines_.begin());
}

void UnitMap::add_stations(std::size_t line, const std::vector<std::uint8_t>& stations) {
    for (const std::uint8_t station : stations) {
        if (station == 0) continue;
        std::optional<Place>& place = direct_[station];
        // Listed on two lines: ambiguous, and guessing could return a wrong value.
        const bool ambiguous = listed_[station] && (!place || place->line != line);
        listed_[station] = true;
        place = ambiguous ? std::nullopt : std::optional(Place{line, station});
    }
}

std::optional<UnitMap::Place> UnitMap::find(std::uint8_t unit) const {
    const auto alias = aliases_.find(unit);
    return alias != aliases_.end() ? alias->second : direct_[unit];
}

Result<Target> UnitMap::route(std::uint8_t unit) const {
    const std::optional<Place> place = find(unit);
    if (!place) return Fault::not_routed;
    return Target{lines_[place->line].bus, place->station};
}

std::optional<UnitTarget> UnitMap::place(std::uint8_t unit) const {
    const std::optional<Place> place = find(unit);
    if (!place) return std::nullopt;
    return UnitTarget{lines_[place->line].name, place->station};
}

std::vector<std::size_t> UnitMap::broadcast(std::uint8_t unit) const {
    const auto alias = aliases_.find(unit);
    if (alias == aliases_.end()) return unit == 0 ? own_ : std::vector<std::size_t>{};
    if (alias->second.station != 0) return {};
    return {alias->second.line};
}

std::vector<bus::BusClient*> UnitMap::broadcast_lines(std::uint8_t unit) const {
    return buses_of(broadcast(unit));
}

std::vector<std::string> UnitMap::broadcast_names(std::uint8_t unit) const {
    std::vector<std::string> names;
    for (const std::size_t line : broadcast(unit)) names.push_back(lines_[line].name);
    return names;
}

std::vector<bus::BusClient*> UnitMap::buses_of(const std::vector<std::size_t>& lines) const {
    std::vector<bus::BusClient*> buses;
    for (const std::size_t line : lines) buses.push_back(lines_[line].bus);
    return buses;
}

}  // namespace panelgate::tcp_server
