// What no gateway can tell from what it should be: the rate of each is measured (limits_test.cpp).

#include "draw.hpp"

namespace panelgate::scenario {
namespace {

/// Its client asks without a pause, so that what is left over of a request meets the next one.
void hurry(Plan& all) {
    all.clients.back().writes = 0;
    all.clients.back().pause = {};
}

void imitate(Plan& all, PanelPlan& panel, bool last) {
    panel.imitates = 2s;
    panel.imitates_last = last;
    panel.overtakes = true;
    panel.think = 100ms;
    all.clients.back().same_read = last;
    hurry(all);
}

/// One whose writes are not all done.
void deafen(Plan& all, PanelPlan& panel) {
    panel.deaf_to_writes = 0.3;
    all.clients.back().writes = 0.5;
}

constexpr Oddness kLimits[] = {
    {Oddity::overtakes,
     [](Plan&, PanelPlan& p) {
         p.overtakes = true;
         p.late = 0.3;
         p.late_limit = 1.8;
     }},
    {Oddity::copies_seldom,
     [](Plan& all, PanelPlan& p) {
         p.duplicate = 0.02;
         p.duplicate_delay = std::chrono::milliseconds(static_cast<int>(2 + all.seed * 7 % 40));
         for (ClientPlan& client : all.clients) client.pause = 500ms;
         hurry(all);
     }},
    {Oddity::unasked, [](Plan& all, PanelPlan& p) { imitate(all, p, false); }},
    {Oddity::repeats_last, [](Plan& all, PanelPlan& p) { imitate(all, p, true); }},
    {Oddity::held_frames,
     [](Plan& all, PanelPlan&) {
         all.line.hands_over = 2s;
         hurry(all);
     }},
    {Oddity::confirms_last,
     [](Plan& all, PanelPlan& p) {
         p.confirms_last = 0.1;
         all.clients.back().writes = 0.5;
     }},
    {Oddity::confirms_again,
     [](Plan& all, PanelPlan& p) {
         p.duplicate = 0.3;
         p.duplicate_delay = 500ms;
         deafen(all, p);
     }},
    {Oddity::answers_twice,
     [](Plan& all, PanelPlan& p) {
         p.duplicate = 1;
         p.duplicate_differs = true;
         p.duplicate_delay = 20ms;
         hurry(all);
     }},
    {Oddity::writes_echoed,
     [](Plan& all, PanelPlan& p) {
         all.line.echo_writes = true;
         all.settings.echo = EchoMode::automatic;
         deafen(all, p);
     }},
    {Oddity::echoed_twice,
     [](Plan& all, PanelPlan& p) {
         all.line.echo = all.line.echo_twice = true;
         all.settings.echo = EchoMode::automatic;
         deafen(all, p);
     }},
    {Oddity::repeats_requests, [](Plan&, PanelPlan& p) { p.repeats_request = 0.3; }},
    {Oddity::misnumbers,
     [](Plan&, PanelPlan& p) {
         p.wrong_function = 0.3;
         p.late = 0.2;
         p.late_limit = 1.8;
     }},
    {Oddity::refuses_first,
     [](Plan& all, PanelPlan& p) {
         p.refuses_first = 0.1;
         hurry(all);
     }},
    {Oddity::damaged_first, [](Plan&, PanelPlan& p) { p.damaged_first = 0.5; }},
};

}  // namespace

std::span<const Oddness> odd_limits() { return kLimits; }

}  // namespace panelgate::scenario
