#include "plan.hpp"

#include <algorithm>
#include <cstdlib>

#include "panelgate/base/serial_format.hpp"
#include "random.hpp"

namespace panelgate::scenario {
namespace {

constexpr int kRates[] = {9600, 19200, 38400, 115200};

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
    panel.exception = maybe(0.03);
    if (random.chance(0.2)) panel.max_registers = random.between(10, 60);
    return panel;
}

void draw_line(Random& random, Plan& plan) {
    arbiter::Settings& s = plan.settings;
    s.serial.baud = kRates[random.below(4)];
    s.serial.parity = random.chance(0.5) ? Parity::even : Parity::none;
    s.paced = random.chance(0.5);
    s.share_reads = random.chance(0.8);
    s.broadcast_turnaround = random.between(20ms, 150ms);
    s.queue.limit = random.between(8, 64);
    s.queue.per_client = random.between(2, 32);
    s.queue.deadline = random.between(500ms, 4s);
    s.offline.after = static_cast<int>(random.between(2, 5));
    s.offline.probe_min = random.between(100ms, 1s);
    s.offline.probe_max = random.between(2s, 10s);
    s.unlisted.response_timeout = random.between(50ms, 400ms);
    s.unlisted.frame_gap = silent_interval(s.serial);
    s.unlisted.retries = static_cast<int>(random.below(3));
    // The quarantine has to reach as far as the latest reply: 3 timeouts are 2 of lateness, and
    // what stands between a reply's first and last byte.
    s.unlisted.late_window = s.unlisted.response_timeout * 5 / 2 + 300ms;
}

void draw_panels(Random& random, Plan& plan, double much) {
    const unsigned count = random.between(2, 8);
    for (unsigned i = 0; i < count; ++i) {
        PanelPlan panel;
        panel.id = static_cast<std::uint8_t>(i * 7 + random.between(1, 7));
        panel.think = random.between(200us, 10ms);
        panel = draw_faults(random, panel, much);
        arbiter::StationSettings station = plan.settings.unlisted;
        station.id = panel.id;
        if (random.chance(0.3)) station.frame_gap = *station.frame_gap + random.between(0us, 4ms);
        plan.settings.stations.push_back(station);
        plan.panels.push_back(panel);
    }
}

void draw_clients(Random& random, Plan& plan, unsigned most) {
    const unsigned count = random.between(1, most);
    for (unsigned i = 0; i < count; ++i) {
        ClientPlan client;
        client.in_flight = random.chance(0.6) ? 1 : random.between(2, 16);
        client.writes = random.chance(0.5) ? random.share() * 0.4 : 0;
        client.broadcasts = random.chance(0.2) ? 0.02 : 0;
        client.polls = random.chance(0.2);
        client.vanish = random.chance(0.3) ? 0.02 : 0;
        client.pause = random.between(0us, 20ms);
        for (const PanelPlan& panel : plan.panels) {
            if (random.chance(0.6)) client.stations.push_back(panel.id);
        }
        if (client.stations.empty()) client.stations.push_back(plan.panels.front().id);
        plan.clients.push_back(std::move(client));
    }
}

/// The reply comes at most this late, and an automatic window reaches as far.
void limit_lateness(Plan& plan, double timeouts) {
    for (PanelPlan& panel : plan.panels) panel.late_limit = timeouts;
}

void draw_dead(Random& random, Plan& plan) {
    for (std::size_t i = 1; i < plan.panels.size(); ++i) {
        if (random.chance(0.5)) plan.panels[i].dead = true;
        if (random.chance(0.3)) plan.panels[i].flapping = random.between(1s, 10s);
    }
}

/// Every client keeps the line busy at a healthy panel, so that what dead ones cost is seen.
void draw_healthy_load(Plan& plan) {
    ClientPlan steady;
    steady.in_flight = 2;
    steady.writes = 0;
    steady.pause = 0us;
    steady.stations = {plan.panels.front().id};
    PanelPlan healthy;
    healthy.id = plan.panels.front().id;
    plan.panels.front() = healthy;
    plan.clients.push_back(steady);
}

}  // namespace

std::string_view label(Kind kind) {
    switch (kind) {
        case Kind::faults:
            return "faults";
        case Kind::station:
            return "station";
        case Kind::echo:
            return "echo";
        case Kind::dead:
            return "dead";
        case Kind::crowd:
            return "crowd";
        case Kind::adaptive:
            return "adaptive";
    }
    std::abort();
}

Plan draw(Kind kind, std::uint64_t seed) {
    Random random(seed * 31 + static_cast<std::uint64_t>(kind));
    Plan plan;
    plan.seed = seed;
    draw_line(random, plan);
    draw_panels(random, plan, kind == Kind::crowd ? 0.1 : 1);
    draw_clients(random, plan, kind == Kind::crowd ? 20 : 6);
    plan.idle_noise = random.chance(0.3) ? 0.2 : 0;
    plan.line_losses = random.chance(0.1) ? 0.02 : 0;
    arbiter::Settings& s = plan.settings;
    const auto each_station = [&](const auto& change) {
        for (arbiter::StationSettings& station : s.stations) change(station);
    };
    switch (kind) {
        case Kind::faults:
            if (random.chance(0.5)) {
                each_station([](auto& station) { station.late_window.reset(); });
                limit_lateness(plan, 1.8);
            }
            break;
        case Kind::station:
            s.quarantine = arbiter::Quarantine::station;
            break;
        case Kind::echo:
            plan.echo = random.chance(0.8);
            plan.damaged_echo = random.chance(0.5) ? 0.05 : 0;
            s.echo = plan.echo && random.chance(0.3) ? arbiter::EchoMode::on
                                                     : arbiter::EchoMode::automatic;
            for (ClientPlan& client : plan.clients) client.writes = std::max(client.writes, 0.3);
            break;
        case Kind::dead:
            draw_dead(random, plan);
            draw_healthy_load(plan);
            break;
        case Kind::crowd:
            each_station([&](auto& station) {
                if (random.chance(0.5)) station.max_age = random.between(10ms, 2s);
            });
            break;
        case Kind::adaptive:
            each_station([](auto& station) { station.adaptive_timeout = true; });
            break;
    }
    return plan;
}

}  // namespace panelgate::scenario
