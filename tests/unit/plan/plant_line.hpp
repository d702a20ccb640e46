#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "panelgate/plan/line_plan.hpp"
#include "panelgate/profile/load_profile.hpp"

namespace panelgate::plan::test {

inline constexpr modbus::Table kRegisters = modbus::Table::holding_registers;

/// A line at 9600 8N1 without polls. Its panels support every rate.
class PlantLine {
  public:
    PlantLine() {
        line.name = "floor1";
        line.serial = {.baud = 9600, .parity = Parity::none};
    }

    Station& add(const std::string& name, const std::string& profile = "generic") {
        Station& station = line.stations.emplace_back();
        station.name = name;
        station.profile = shipped.find(profile);
        return station;
    }
    /// The ends of copy().
    void add_both() {
        for (const char* name : {"from", "to"}) add(name);
    }

    static void ask(Station& station, std::uint32_t first, std::uint32_t count, Duration every) {
        station.asked.push_back({{{kRegisters, first, count}, every}, "R" + std::to_string(first)});
    }
    /// What is written there is read at the same addresses only.
    static void show_as_written(Station& station) {
        station.memory.shown_as = [](const modbus::Span& written) { return std::vector{written}; };
    }

    /// A relay from the first to the second station, which both exist.
    Relay& copy(std::uint32_t first, std::uint32_t count, Duration every) {
        Relay& relay = line.relays.emplace_back();
        relay.name = "copy" + std::to_string(first);
        relay.every = every;
        relay.from = Relay::End{0, {kRegisters, first, count}};
        relay.to = Relay::End{1, {kRegisters, first + 500, count}};
        return relay;
    }

    profile::Catalogue shipped = profile::Catalogue::shipped();
    Line line;
};

}  // namespace panelgate::plan::test
