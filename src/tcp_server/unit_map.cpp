#include "panelgate/tcp_server/unit_map.hpp"

#include <algorithm>
#include <stdexcept>

#include "panelgate/modbus/function.hpp"

namespace panelgate::tcp_server {
namespace {

const LineInfo& find_line(const std::vector<LineInfo>& lines, const std::string& name) {
    const auto at = std::ranges::find(lines, name, &LineInfo::name);
    if (at == lines.end()) throw std::invalid_argument("no line is called \"" + name + "\"");
    return *at;
}

std::vector<LineInfo> own_lines(const Settings& settings, const std::vector<LineInfo>& lines) {
    if (settings.lines.empty()) return lines;
    std::vector<LineInfo> own;
    for (const std::string& name : settings.lines) own.push_back(find_line(lines, name));
    return own;
}

}  // namespace

UnitMap::UnitMap(const Settings& settings, const std::vector<LineInfo>& lines) {
    for (const auto& [unit, target] : settings.units) {
        const LineInfo& line = find_line(lines, target.line);
        aliases_[unit] = Target{line.bus, target.station};
    }
    const std::vector<LineInfo> own = own_lines(settings, lines);
    for (const LineInfo& line : own) {
        lines_.push_back(line.bus);
        add_stations(line);
    }
    if (own.size() != 1 || !own.front().pass_unlisted) return;
    for (std::uint8_t station = 1; station <= modbus::kMaxStation; ++station) {
        if (!listed_[station]) direct_[station] = Target{own.front().bus, station};
    }
}

void UnitMap::add_stations(const LineInfo& line) {
    for (const std::uint8_t station : line.stations) {
        if (station == 0 || station > modbus::kMaxStation) continue;
        // On two lines: nobody can say which one is meant, and a guess would be a wrong value.
        const bool ambiguous = listed_[station] && direct_[station].bus != line.bus;
        listed_[station] = true;
        direct_[station] = ambiguous ? Target{} : Target{line.bus, station};
    }
}

Result<Target> UnitMap::route(std::uint8_t unit) const {
    if (const auto alias = aliases_.find(unit); alias != aliases_.end()) return alias->second;
    if (direct_[unit].bus == nullptr) return Fault::not_routed;
    return direct_[unit];
}

std::vector<bus::BusClient*> UnitMap::broadcast_lines(std::uint8_t unit) const {
    if (const auto alias = aliases_.find(unit); alias != aliases_.end()) {
        if (alias->second.station != 0) return {};
        return {alias->second.bus};
    }
    if (unit != 0) return {};
    return lines_;
}

}  // namespace panelgate::tcp_server
