#include <algorithm>
#include <cstdlib>

#include "draw.hpp"
#include "panelgate/base/serial_format.hpp"

namespace panelgate::scenario {
namespace {

/// Its answer is there before the computed end of the request: both say their characters in half of
/// the time.
void make_quick(Plan& all, PanelPlan& panel) {
    all.settings.paced = false;
    all.line.own_rate = 0.5;
    panel.own_rate = 0.5;
    panel.think = {};
    panel.eager = true;
}

/// In every other seed its station has the key that it needs, and then no request may fail.
void make_pausing(Plan& all, PanelPlan& panel) {
    const auto pause = static_cast<int>(30 + all.seed * 7 % 71);
    panel.deaf_after = std::chrono::milliseconds(pause);
    if (all.seed % 2 == 0) return;
    all.settings.stations.back().station_gap = panel.deaf_after + 2ms;
    all.clients.back().polite = true;
}

constexpr Oddness kThreats[] = {
    {Oddity::wrong_function, [](Plan&, PanelPlan& p) { p.wrong_function = 1; }},
    {Oddity::padded_inside, [](Plan&, PanelPlan& p) { p.padded_inside = 1; }},
    {Oddity::padded_behind, [](Plan&, PanelPlan& p) { p.padded_behind = 1; }},
    {Oddity::doubled,
     [](Plan&, PanelPlan& p) {
         p.duplicate = 1;
         p.duplicate_delay = 30ms;
     }},
    {Oddity::tails, [](Plan&, PanelPlan& p) { p.tail = 1; }},
    {Oddity::fragments, [](Plan&, PanelPlan& p) { p.fragment = 1; }},
    {Oddity::glitches, [](Plan&, PanelPlan& p) { p.glitch_before = p.glitch_behind = 1; }},
    {Oddity::holes,
     [](Plan&, PanelPlan& p) {
         p.hole = 0.3;
         p.hole_limit = 40ms;
     }},
    {Oddity::naps,
     [](Plan& all, PanelPlan& p) {
         p.nap = 0.02;
         for (arbiter::StationSettings& station : all.settings.stations)
             station.late_window = std::max<Duration>(*station.late_window, 2300ms);
     }},
    {Oddity::mute, [](Plan&, PanelPlan& p) { p.mute = 0.2; }},
    {Oddity::drops, [](Plan&, PanelPlan& p) { p.drop = 0.2; }},
    {Oddity::flips, [](Plan&, PanelPlan& p) { p.flip = 0.3; }},
    {Oddity::reboots, [](Plan&, PanelPlan& p) { p.reboots = 10s; }},
    {Oddity::babbles,
     [](Plan& all, PanelPlan&) {
         // What hits a request costs its timeout (T1): more often, and the line is of no use.
         constexpr std::size_t kFrame = 13;
         const Duration often = 60 * frame_time(all.settings.serial, kFrame);
         all.line.babble = all.seed % 2 == 0 ? std::max<Duration>(1s, often) : Duration(5s);
     }},
    {Oddity::answers_broadcasts,
     [](Plan& all, PanelPlan& p) {
         p.answers_broadcasts = true;
         for (ClientPlan& client : all.clients) client.broadcasts = 0.02;
     }},
    {Oddity::broadcasts_late,
     [](Plan& all, PanelPlan& p) {
         p.answers_broadcasts = true;
         p.broadcast_think = 150ms;
         p.deaf_to_writes = 0.3;
         for (ClientPlan& client : all.clients) client.broadcasts = 0.02;
     }},
    {Oddity::dies, [](Plan&, PanelPlan& p) { p.flapping = 10s; }},
    {Oddity::refuses_long,
     [](Plan& all, PanelPlan& p) {
         p.max_registers = 20;
         p.refusal = 1 + static_cast<unsigned>(all.seed % 4);
     }},
    {Oddity::ignores_long,
     [](Plan&, PanelPlan& p) {
         p.max_registers = 20;
         p.refusal = 0;
     }},
    {Oddity::outlives_connection,
     [](Plan& all, PanelPlan& p) {
         all.settings.may_stall = true;
         all.settings.paced = false;
         all.line.losses = 0.3;
         p.any_connection = true;
         p.late = 0.2;
         p.late_limit = 1.8;
     }},
    {Oddity::pauses, make_pausing},
    {Oddity::quick, make_quick},
    {Oddity::neighbours,
     [](Plan& all, PanelPlan& p) {
         p.flapping = 10s;
         for (PanelPlan& panel : all.panels)
             panel.expects_replies = all.settings.unlisted.response_timeout;
     }},
};

void make_odd(Oddity oddity, Plan& plan) {
    for (const auto& rows : {odd_threats(), odd_limits()}) {
        const auto row = std::ranges::find(rows, oddity, &Oddness::oddity);
        if (row != rows.end()) return row->make(plan, plan.panels.back());
    }
    std::abort();
}

}  // namespace

std::span<const Oddness> odd_threats() { return kThreats; }

Plan without_oddity(Plan plan) {
    PanelPlan plain = plain_panel(plan.odd);
    plain.think = plan.panels.back().think;
    plain.own_rate = plan.line.own_rate;
    plan.panels.back() = plain;
    plan.line.babble = plan.line.hands_over = {};
    plan.line.echo = plan.line.echo_writes = plan.line.echo_twice = false;
    plan.limit = Limit::none;
    return plan;
}

Plan draw_odd(Oddity oddity, std::uint64_t seed) {
    Random random(seed * 37);
    Plan plan;
    plan.seed = seed;
    plan.limit = row_of(oddity)->limit;
    draw_line(random, plan);
    arbiter::Settings& s = plan.settings;
    s.queue.limit = 64;
    s.queue.deadline = 8s;
    s.unlisted.response_timeout = random.between(200ms, 500ms);
    s.unlisted.retries = 1;
    s.unlisted.late_window = s.unlisted.response_timeout * 5 / 2 + 300ms;
    const unsigned count = random.between(4, 6);
    for (unsigned i = 0; i < count; ++i) {
        PanelPlan panel = plain_panel(static_cast<std::uint8_t>(i * 5 + 1));
        panel.think = random.between(200us, 10ms);
        add_station(plan, panel);
    }
    if (random.chance(0.3)) draw_extreme_rate(random, plan);
    // Who asks all of them cannot tell whose fault a wait is: one client for each panel.
    for (const PanelPlan& panel : plan.panels) {
        ClientPlan client;
        client.writes = random.chance(0.5) ? 0.2 : 0;
        client.pause = random.between(1ms, 20ms);
        client.stations = {panel.id};
        client.polite = panel.id != plan.panels.back().id;
        plan.clients.push_back(client);
    }
    plan.odd = plan.panels.back().id;
    make_odd(oddity, plan);
    return plan;
}

}  // namespace panelgate::scenario
