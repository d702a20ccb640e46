#pragma once

#include <span>

#include "plan.hpp"
#include "random.hpp"

namespace panelgate::scenario {

/// What a plan is made of, each drawn by itself.
void draw_line(Random& random, Plan& plan);
/// A line that is as slow, or as fast, as lines get: only where nothing depends on quick frames.
void draw_extreme_rate(Random& random, Plan& plan);
/// Another master, babble, noise that does not end.
void draw_company(Random& random, Plan& plan);
void draw_receiver(Random& random, Plan& plan);
void draw_losses(Random& random, Plan& plan);
void draw_stalls(Random& random, Plan& plan);

/// 2 to 8 panels with `much` of every fault that can spoil an answer.
void draw_panels(Random& random, Plan& plan, double much);
/// Quick and slow, spoken oddly, and yet each answer is there (PanelPlan::is_sound).
void draw_voices(Random& random, Plan& plan);
void draw_dead(Random& random, Plan& plan);
/// Half of the panels are dead and alive in the same turns; nothing else is wrong with any.
void draw_mass(Random& random, Plan& plan);
/// Other faults that some panels have for good.
void draw_manners(Random& random, Plan& plan);
/// A panel that the settings do not list.
void draw_unlisted(Random& random, Plan& plan);
/// As good as panels get.
PanelPlan plain_panel(std::uint8_t id);
void add_station(Plan& plan, const PanelPlan& panel);

void draw_clients(Random& random, Plan& plan, unsigned most);
/// A client that keeps the line busy at the first panel, which is made plain.
void draw_healthy_load(Plan& plan);
void draw_flood(Random& random, Plan& plan);
void draw_writers(Random& random, Plan& plan);

/// What makes a line odd: all of it but the odd panel, and that.
struct Oddness {
    Oddity oddity;
    void (*make)(Plan& all, PanelPlan& panel);
};
std::span<const Oddness> odd_threats();
std::span<const Oddness> odd_limits();

}  // namespace panelgate::scenario
