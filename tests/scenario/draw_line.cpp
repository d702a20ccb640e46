#include <algorithm>

#include "draw.hpp"
#include "panelgate/base/serial_format.hpp"

namespace panelgate::scenario {

void draw_line(Random& random, Plan& plan) {
    constexpr int kRates[] = {9600, 19200, 38400, 115200};
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
    // what stands between a reply's first and last byte. A reply that is later than this and has
    // the shape of the one that is then awaited is that one for any gateway.
    s.unlisted.late_window = s.unlisted.response_timeout * 5 / 2 + 300ms;
}

void draw_extreme_rate(Random& random, Plan& plan) {
    constexpr int kRates[] = {1200, 2400, 460800, 921600};
    arbiter::Settings& s = plan.settings;
    s.serial.baud = kRates[random.below(4)];
    const bool slow = s.serial.baud < 9600;
    s.unlisted.frame_gap = silent_interval(s.serial);
    for (arbiter::StationSettings& station : s.stations) station.frame_gap = s.unlisted.frame_gap;
    if (!slow) return;
    // A joined read of 125 registers takes 2.3 s at 1200.
    s.share_reads = false;
    s.queue.deadline = 10s;
}

void draw_company(Random& random, Plan& plan) {
    LinePlan& line = plan.line;
    if (random.chance(0.4)) line.babble = random.chance(0.5) ? Duration(100ms) : Duration(5s);
    line.other_master = random.chance(0.4);
    line.floating = random.chance(0.4) ? 0.1 : 0;
    line.idle_noise = random.chance(0.3) ? 0.2 : 0;
}

/// What of our own frame comes back. An echo that differs now and then is a collision; one that
/// always lacks its end is how that adapter is.
void draw_receiver(Random& random, Plan& plan) {
    LinePlan& line = plan.line;
    if (random.chance(0.5)) {
        line.partial_echo = random.chance(0.5) ? 1 : random.share() * 0.5;
        return;
    }
    line.echo = true;
    line.damaged_echo = random.chance(0.5) ? random.share() * 0.2 : 0;
    line.cut_echo = random.chance(0.3) ? 1 : random.chance(0.5) ? random.share() * 0.1 : 0;
}

void draw_losses(Random& random, Plan& plan) {
    LinePlan& line = plan.line;
    line.losses = random.chance(0.7) ? 0.05 + random.share() * 0.3 : 0;
    line.handover = random.share();
    line.pauses = random.chance(0.5) ? 0.1 : 0;
    for (ClientPlan& client : plan.clients)
        client.leaves = random.chance(0.5) ? random.share() * 2 : 0;
}

/// Of a line that may hold frames back for longer than any late window nothing is known by time
/// alone, so its settings say so. Its panels are never late themselves: with both, a second late
/// reply behind the one that was awaited has no bound.
void draw_stalls(Random& random, Plan& plan) {
    plan.settings.may_stall = true;
    plan.settings.paced = false;
    plan.settings.reply_hole = 400ms;
    plan.line.stalls = 0.05 + random.share() * 0.3;
    plan.line.hangs = random.chance(0.5);
    for (PanelPlan& panel : plan.panels) {
        panel.late = 0;
        panel.nap = 0;
    }
}

}  // namespace panelgate::scenario
