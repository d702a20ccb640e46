#include <algorithm>

#include "draw.hpp"
#include "panelgate/base/serial_format.hpp"

namespace panelgate::scenario {
namespace {

PanelPlan draw_faults(Random& random, PanelPlan panel, double much) {
    const auto maybe = [&](double most) {
        return random.chance(0.5) ? random.share() * most * much : 0;
    };
    panel.late = maybe(0.10);
    panel.drop = maybe(0.05);
    panel.mute = maybe(0.05);
    panel.flip = maybe(0.05);
    panel.truncate = maybe(0.05);
    panel.noise = maybe(0.05);
    panel.wrong_id = maybe(0.03);
    panel.foreign = maybe(0.05);
    panel.duplicate = maybe(0.05);
    panel.duplicate_delay = 1ms;
    panel.exception = maybe(0.03);
    panel.ring = random.chance(0.7);
    if (random.chance(0.2)) panel.max_registers = random.between(10, 60);
    return panel;
}

/// A pause that no gateway may end a reply for: a full FIFO is 15 ms late itself.
Duration bearable_hole(const Plan& plan) {
    return plan.settings.reply_hole - 17ms - character_time(plan.settings.serial);
}

}  // namespace

PanelPlan plain_panel(std::uint8_t id) {
    PanelPlan panel;
    panel.id = id;
    return panel;
}

void add_station(Plan& plan, const PanelPlan& panel) {
    arbiter::StationSettings station = plan.settings.unlisted;
    station.id = panel.id;
    plan.settings.stations.push_back(station);
    plan.panels.push_back(panel);
}

void draw_panels(Random& random, Plan& plan, double much) {
    const unsigned count = random.between(2, 8);
    for (unsigned i = 0; i < count; ++i) {
        PanelPlan panel;
        panel.id = static_cast<std::uint8_t>(i * 7 + random.between(1, 7));
        panel.think = random.between(200us, 10ms);
        panel = draw_faults(random, panel, much);
        add_station(plan, panel);
        arbiter::StationSettings& station = plan.settings.stations.back();
        if (random.chance(0.3))
            station.frame_gap =
                silent_interval(plan.settings.serial) + random.between(0us, Duration(4ms));
    }
}

void draw_voices(Random& random, Plan& plan) {
    // The slowest of them begins within 80 ms, 30 ms of a header's pause and what goes before.
    plan.settings.unlisted.response_timeout = random.between(200ms, 500ms);
    plan.line.own_rate = 1 + 0.036 * (random.share() - 0.5);
    const unsigned count = random.between(2, 8);
    for (unsigned i = 0; i < count; ++i) {
        PanelPlan panel;
        panel.id = static_cast<std::uint8_t>(i * 7 + random.between(1, 7));
        const auto maybe = [&](double share) {
            return random.chance(0.3) ? (random.chance(0.5) ? 1 : random.share() * share) : 0;
        };
        panel.think = random.between(200us, Duration(random.chance(0.7) ? 10ms : 80ms));
        if (random.chance(0.3)) panel.slow_think = random.between(200us, 80ms);
        panel.swing = random.between(1s, 20s);
        panel.eager = random.chance(0.5);
        panel.ring = random.chance(0.7);
        panel.own_rate = 1 + 0.036 * (random.share() - 0.5);
        panel.fragment = maybe(0.1);
        panel.glitch_before = maybe(0.2);
        panel.glitch_behind = maybe(0.2);
        panel.hole = maybe(0.2);
        panel.hole_limit = bearable_hole(plan);
        panel.tail = maybe(0.2);
        // Seldom enough to be forgotten between two, each would be the first for any gateway.
        panel.duplicate = random.chance(0.3) ? 0.1 + 0.9 * random.share() : 0;
        panel.duplicate_delay = random.between(0us, 30ms);
        panel.padded_behind = maybe(0.2);
        if (random.chance(0.3)) {
            panel.max_registers = random.between(20, 60);
            panel.refusal = random.below(5);
        }
        add_station(plan, panel);
    }
}

void draw_manners(Random& random, Plan& plan) {
    for (PanelPlan& panel : plan.panels) {
        const auto maybe = [&](double most) {
            return random.chance(0.3) ? random.share() * most : 0;
        };
        panel.fragment = maybe(0.2);
        panel.tail = maybe(0.3);
        panel.glitch_behind = maybe(0.3);
        panel.duplicate = random.chance(0.2) ? 0.1 + 0.9 * random.share() : 0;
        panel.duplicate_delay = random.between(0us, 30ms);
        panel.hole = maybe(0.1);
        panel.hole_limit = 2 * plan.settings.reply_hole;
        panel.answers_broadcasts = random.chance(0.2);
        panel.eager = random.chance(0.3);
        if (random.chance(0.1)) panel.reboots = random.between(10s, 60s);
        if (random.chance(0.2)) {
            panel.max_registers = random.between(10, 60);
            panel.refusal = random.below(5);
        }
        if (random.chance(0.1)) panel.nap = 0.005;
    }
    // 2 s of thinking have to be inside the window.
    for (std::size_t i = 0; i < plan.settings.stations.size(); ++i) {
        arbiter::StationSettings& station = plan.settings.stations[i];
        if (plan.panels[i].nap > 0 && station.late_window)
            station.late_window = std::max<Duration>(*station.late_window, 2300ms);
        if (!station.late_window) plan.panels[i].nap = 0;
    }
}

void draw_unlisted(Random& random, Plan& plan) {
    PanelPlan panel = plain_panel(240);
    panel.listed = false;
    panel.think = random.between(200us, 10ms);
    plan.panels.insert(plan.panels.begin(), panel);
    plan.clients.front().stations.push_back(panel.id);
}

void draw_dead(Random& random, Plan& plan) {
    for (std::size_t i = 1; i < plan.panels.size(); ++i) {
        if (random.chance(0.5)) plan.panels[i].dead = true;
        if (random.chance(0.3)) plan.panels[i].flapping = random.between(1s, 10s);
    }
}

void draw_mass(Random& random, Plan& plan) {
    const Duration turn = random.between(5s, 30s);
    const unsigned count = random.between(4, 20);
    for (unsigned i = 0; i < count; ++i) {
        PanelPlan panel = plain_panel(static_cast<std::uint8_t>(i * 3 + 1));
        panel.think = random.between(200us, 20ms);
        if (i % 2 == 1) panel.flapping = turn;
        if (i % 8 == 5) panel.dead = true;
        add_station(plan, panel);
    }
}

}  // namespace panelgate::scenario
