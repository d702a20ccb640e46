#include <algorithm>
#include <array>

#include "changes.hpp"

namespace panelgate::plan {
namespace {

constexpr std::array kRates{2400, 4800, 9600, 19200, 38400, 57600, 115200};

bool all_have(const Line& line, int baud) {
    return std::ranges::all_of(line.stations, [&](const Station& station) {
        return profile::allows(station.profile->serial.baud, baud);
    });
}

}  // namespace

std::optional<Change> quicker(const Line& line) {
    std::optional<Change> found;
    for (const int baud : kRates) {
        if (baud <= line.serial.baud || !all_have(line, baud)) continue;
        found = Change{"serial: {baud: " + std::to_string(baud) + "} (of all panels, too)",
                       at_rate(line, baud)};
        if (verdict(make_plan(found->line)) == Verdict::fine) break;
    }
    return found;
}

}  // namespace panelgate::plan
