#include "field.hpp"

#include <utility>

#include "draw.hpp"
#include "panelgate/base/serial_format.hpp"
#include "play.hpp"

namespace panelgate::scenario {

Plan quiet_line(int baud, unsigned panels, Duration think) {
    Plan plan;
    plan.settings.serial.baud = baud;
    plan.settings.unlisted.frame_gap = silent_interval(plan.settings.serial);
    for (unsigned i = 1; i <= panels; ++i) {
        PanelPlan panel = plain_panel(static_cast<std::uint8_t>(i));
        panel.think = think;
        panel.late_limit = 1.8;
        add_station(plan, panel);
    }
    plan.transactions = 500;
    return plan;
}

ClientPlan& add_client(Plan& plan, std::vector<std::uint8_t> stations, double writes) {
    ClientPlan client;
    client.stations = std::move(stations);
    client.writes = writes;
    client.pause = 2ms;
    plan.clients.push_back(std::move(client));
    return plan.clients.back();
}

std::string broken(Plan plan) {
    constexpr std::uint64_t kSeeds = 10;
    for (plan.seed = 1; plan.seed <= kSeeds; ++plan.seed) {
        const Outcome outcome = play(plan, true);
        if (!outcome.violation.empty())
            return "seed " + std::to_string(plan.seed) + ": " + outcome.violation + '\n' +
                   outcome.history;
    }
    return {};
}

}  // namespace panelgate::scenario
