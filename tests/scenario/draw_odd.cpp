#include <algorithm>

#include "draw.hpp"

namespace panelgate::scenario {
namespace {

struct Row {
    Oddity oddity;
    std::string_view name;
    void (*make)(Plan& all, PanelPlan& panel);
};

/// Its client asks the very same without a pause, so that what is left over of a request meets the
/// next one.
void imitate(Plan& all, PanelPlan& panel, bool last) {
    panel.imitates = 2s;
    panel.imitates_last = last;
    panel.overtakes = true;
    panel.think = 100ms;
    all.clients.back().same_read = last;
    all.clients.back().writes = 0;
    all.clients.back().pause = {};
}

constexpr Row kRows[] = {
    {Oddity::none, "none",
     [](Plan&, PanelPlan&) {

     }},
    {Oddity::wrong_function, "wrong_function", [](Plan&, PanelPlan& p) { p.wrong_function = 1; }},
    {Oddity::padded_inside, "padded_inside", [](Plan&, PanelPlan& p) { p.padded_inside = 1; }},
    {Oddity::padded_behind, "padded_behind", [](Plan&, PanelPlan& p) { p.padded_behind = 1; }},
    {Oddity::doubled, "doubled",
     [](Plan&, PanelPlan& p) {
         p.duplicate = 1;
         p.duplicate_delay = 30ms;
     }},
    {Oddity::tails, "tails", [](Plan&, PanelPlan& p) { p.tail = 1; }},
    {Oddity::fragments, "fragments", [](Plan&, PanelPlan& p) { p.fragment = 1; }},
    {Oddity::glitches, "glitches",
     [](Plan&, PanelPlan& p) { p.glitch_before = p.glitch_behind = 1; }},
    {Oddity::damaged_first, "damaged_first", [](Plan&, PanelPlan& p) { p.damaged_first = 0.5; }},
    {Oddity::holes, "holes",
     [](Plan&, PanelPlan& p) {
         p.hole = 0.3;
         p.hole_limit = 40ms;
     }},
    {Oddity::naps, "naps", [](Plan&, PanelPlan& p) { p.nap = 0.02; }},
    {Oddity::mute, "mute", [](Plan&, PanelPlan& p) { p.mute = 0.2; }},
    {Oddity::drops, "drops", [](Plan&, PanelPlan& p) { p.drop = 0.2; }},
    {Oddity::flips, "flips", [](Plan&, PanelPlan& p) { p.flip = 0.3; }},
    {Oddity::reboots, "reboots", [](Plan&, PanelPlan& p) { p.reboots = 10s; }},
    {Oddity::babbles, "babbles",
     [](Plan& all, PanelPlan&) {
         all.line.babble = all.seed % 2 == 0 ? Duration(100ms) : Duration(5s);
     }},
    {Oddity::answers_broadcasts, "answers_broadcasts",
     [](Plan& all, PanelPlan& p) {
         p.answers_broadcasts = true;
         for (ClientPlan& client : all.clients) client.broadcasts = 0.02;
     }},
    {Oddity::dies, "dies", [](Plan&, PanelPlan& p) { p.flapping = 10s; }},
    {Oddity::refuses_long, "refuses_long",
     [](Plan& all, PanelPlan& p) {
         p.max_registers = 20;
         p.refusal = 1 + static_cast<unsigned>(all.seed % 4);
     }},
    {Oddity::ignores_long, "ignores_long",
     [](Plan&, PanelPlan& p) {
         p.max_registers = 20;
         p.refusal = 0;
     }},
    {Oddity::unasked, "unasked", [](Plan& all, PanelPlan& p) { imitate(all, p, false); }},
    {Oddity::repeats_last, "repeats_last", [](Plan& all, PanelPlan& p) { imitate(all, p, true); }},
    {Oddity::writes_echoed, "writes_echoed",
     [](Plan& all, PanelPlan& p) {
         all.line.echo_writes = true;
         all.settings.echo = EchoMode::automatic;
         p.deaf_to_writes = 0.3;
     }},
    {Oddity::echoed_twice, "echoed_twice",
     [](Plan& all, PanelPlan& p) {
         all.line.echo = all.line.echo_twice = true;
         all.settings.echo = EchoMode::automatic;
         p.deaf_to_writes = 0.3;
     }},
    {Oddity::broadcasts_late, "broadcasts_late",
     [](Plan& all, PanelPlan& p) {
         p.answers_broadcasts = true;
         p.broadcast_think = 150ms;
         p.deaf_to_writes = 0.3;
         for (ClientPlan& client : all.clients) client.broadcasts = 0.02;
     }},
    {Oddity::repeats_requests, "repeats_requests",
     [](Plan&, PanelPlan& p) { p.repeats_request = 0.3; }},
    {Oddity::overtakes, "overtakes",
     [](Plan&, PanelPlan& p) {
         p.overtakes = true;
         p.late = 0.3;
         p.late_limit = 1.8;
     }},
    {Oddity::outlives_connection, "outlives_connection",
     [](Plan& all, PanelPlan& p) {
         all.settings.may_stall = true;
         all.settings.paced = false;
         all.line.losses = 0.3;
         p.any_connection = true;
         p.late = 0.2;
         p.late_limit = 1.8;
     }},
};

const Row& row_of(Oddity oddity) { return *std::ranges::find(kRows, oddity, &Row::oddity); }

}  // namespace

std::string_view label(Oddity oddity) { return row_of(oddity).name; }

Plan without_oddity(Plan plan) {
    PanelPlan plain = plain_panel(plan.odd);
    plain.think = plan.panels.back().think;
    plan.panels.back() = plain;
    plan.line.babble = {};
    plan.line.echo = plan.line.echo_writes = plan.line.echo_twice = false;
    return plan;
}

Plan draw_odd(Oddity oddity, std::uint64_t seed) {
    Random random(seed * 37);
    Plan plan;
    plan.seed = seed;
    draw_line(random, plan);
    arbiter::Settings& s = plan.settings;
    s.queue.limit = 64;
    s.queue.deadline = 8s;
    s.unlisted.response_timeout = random.between(200ms, 500ms);
    s.unlisted.retries = 1;
    s.unlisted.late_window = s.unlisted.response_timeout * 5 / 2 + 300ms;
    if (oddity == Oddity::naps)
        s.unlisted.late_window = std::max<Duration>(*s.unlisted.late_window, 2300ms);
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
    row_of(oddity).make(plan, plan.panels.back());
    return plan;
}

}  // namespace panelgate::scenario
