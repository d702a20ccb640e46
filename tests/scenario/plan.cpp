#include "plan.hpp"

#include <algorithm>

#include "draw.hpp"
#include "random.hpp"

namespace panelgate::scenario {

bool PanelPlan::is_sound(Duration timeout, Duration reply_hole) const {
    constexpr unsigned kLongestRead = 20;  // that a client asks for
    const bool ever_silent = drop > 0 || deaf_to_writes > 0 || mute > 0 || nap > 0 || late > 0 ||
                             dead || flapping > Duration::zero() || reboots > Duration::zero() ||
                             only_registers > 0 || confirms_last > 0 ||
                             deaf_after > Duration::zero() ||
                             (refusal == 0 && max_registers < kLongestRead);
    const bool ever_wrong = flip > 0 || truncate > 0 || noise > 0 || wrong_id > 0 || foreign > 0 ||
                            wrong_function > 0 || refuses_first > 0 || damaged_first > 0 ||
                            padded_inside > 0 || imitates > Duration::zero() || repeats_request > 0;
    const Duration slowest = std::max(think, slow_think) + (fragment > 0 ? 40ms : 10ms);
    return !ever_silent && !ever_wrong && slowest < timeout &&
           (hole == 0 || hole_limit + 16ms < reply_hole);
}

bool PanelPlan::only_dies() const {
    return drop == 0 && deaf_to_writes == 0 && mute == 0 && nap == 0 && late == 0 && flip == 0 &&
           truncate == 0 && wrong_id == 0 && wrong_function == 0 && foreign == 0 &&
           slow_think == Duration::zero();
}

bool Plan::is_sound(const PanelPlan& panel) const {
    return panel.is_sound(settings.unlisted.response_timeout, settings.reply_hole);
}

bool Plan::is_calm() const {
    // What comes later than a copy does is a late reply, for all that anybody knows.
    static constexpr Duration kLatestCopy = 60ms;
    const auto in_time = [](const PanelPlan& p) {
        return (p.duplicate == 0 || p.duplicate_delay <= kLatestCopy) && p.late == 0 &&
               p.nap == 0 && p.damaged_first == 0 && p.slow_think == Duration::zero();
    };
    const bool nothing_held = !settings.may_stall && line.pauses == 0 && line.losses == 0;
    const bool alone =
        line.idle_noise == 0 && !line.other_master && line.cut_echo == 0 && line.damaged_echo == 0;
    return std::ranges::all_of(panels, in_time) && nothing_held && alone &&
           settings.quarantine != arbiter::Quarantine::line;
}

namespace {

void each_station(Plan& plan, const auto& change) {
    for (arbiter::StationSettings& station : plan.settings.stations) change(station);
}

/// The reply comes at most this late, and an automatic window reaches as far.
void trust_automatic_window(Plan& plan) {
    each_station(plan, [](auto& station) { station.late_window.reset(); });
    for (PanelPlan& panel : plan.panels) panel.late_limit = 1.8;
}

/// Of panels of which many are that late, some replies outlast the automatic window.
void draw_beyond(Plan& plan) {
    each_station(plan, [](auto& station) { station.late_window.reset(); });
    for (PanelPlan& panel : plan.panels) {
        panel.late = 0.02;
        panel.late_limit = 3;
    }
}

void draw_echo(Random& random, Plan& plan) {
    arbiter::Settings& s = plan.settings;
    plan.line.echo = random.chance(0.8);
    plan.line.damaged_echo = random.chance(0.5) ? 0.05 : 0;
    s.echo = plan.line.echo && random.chance(0.3) ? EchoMode::on : EchoMode::automatic;
    for (ClientPlan& client : plan.clients) client.writes = std::max(client.writes, 0.3);
}

void draw_retried_writes(Random& random, Plan& plan) {
    each_station(plan, [&](auto& station) { station.retry_writes = random.chance(0.3); });
}

void draw_everything(Random& random, Plan& plan) {
    draw_manners(random, plan);
    draw_company(random, plan);
    if (random.chance(0.5)) draw_receiver(random, plan);
    draw_losses(random, plan);
    draw_retried_writes(random, plan);
    draw_unlisted(random, plan);
    if (random.chance(0.3)) draw_stalls(random, plan);
    plan.settings.echo = EchoMode::automatic;
}

/// Panels whose answers are all there: what goes wrong is somebody else's.
void draw_sound(Random& random, Plan& plan, Kind kind) {
    arbiter::Settings& s = plan.settings;
    s.queue.deadline = random.between(2s, 6s);
    if (kind == Kind::mass) {
        draw_mass(random, plan);
        draw_clients(random, plan, 6);
        draw_healthy_load(plan);
        plan.transactions = 3000;
        if (random.chance(0.3)) {
            ClientPlan scan;
            scan.scans = true;
            scan.writes = 0;
            scan.pause = 20ms;
            plan.clients.push_back(scan);
        }
        return;
    }
    draw_voices(random, plan);
    // Those who count turns and places need panels that are quick to the point.
    if (kind == Kind::flood || kind == Kind::writers) {
        for (PanelPlan& panel : plan.panels) {
            panel = plain_panel(panel.id);
            panel.think = random.between(200us, 10ms);
        }
    }
    draw_clients(random, plan, 6);
    if (kind == Kind::flood) draw_flood(random, plan);
    if (kind == Kind::writers) draw_writers(random, plan);
    if (kind == Kind::receiver) draw_receiver(random, plan);
    if (kind == Kind::company) {
        draw_company(random, plan);
        draw_unlisted(random, plan);
    }
    // A line with an echo that is said to have none confirms writes by themselves: no plan.
    const bool learns = kind == Kind::receiver || random.chance(0.7);
    s.echo = learns ? EchoMode::automatic : EchoMode::off;
    if (kind == Kind::voices && random.chance(0.2)) draw_extreme_rate(random, plan);
    s.unlisted.late_window = s.unlisted.response_timeout * 5 / 2 + 300ms;
    each_station(plan, [&](auto& station) { station.late_window = s.unlisted.late_window; });
}

/// Panels with faults that spoil answers.
void draw_faulty(Random& random, Plan& plan, Kind kind) {
    draw_panels(random, plan, kind == Kind::crowd ? 0.1 : 1);
    draw_clients(random, plan, kind == Kind::crowd ? 20 : 6);
    plan.line.idle_noise = random.chance(0.3) ? 0.2 : 0;
    plan.line.losses = random.chance(0.1) ? 0.02 : 0;
    arbiter::Settings& s = plan.settings;
    if (kind == Kind::faults && random.chance(0.5)) trust_automatic_window(plan);
    if (kind == Kind::station) s.quarantine = arbiter::Quarantine::station;
    if (kind == Kind::echo) draw_echo(random, plan);
    if (kind == Kind::dead) {
        draw_dead(random, plan);
        draw_healthy_load(plan);
    }
    if (kind == Kind::crowd) {
        each_station(plan, [&](auto& station) {
            if (random.chance(0.5)) station.max_age = random.between(10ms, 2s);
        });
    }
    if (kind == Kind::adaptive)
        each_station(plan, [](auto& station) { station.adaptive_timeout = true; });
    if (kind == Kind::loss) {
        draw_losses(random, plan);
        draw_retried_writes(random, plan);
    }
    if (kind == Kind::stall) draw_stalls(random, plan);
    if (kind == Kind::wild) draw_everything(random, plan);
    if (kind == Kind::beyond) draw_beyond(plan);
}

bool is_of_sound_panels(Kind kind) {
    return kind == Kind::voices || kind == Kind::receiver || kind == Kind::company ||
           kind == Kind::flood || kind == Kind::mass || kind == Kind::writers;
}

/// Every other panel has old firmware.
void mix_crc_orders(Plan& plan) {
    for (std::size_t i = 0; i < plan.panels.size(); i += 2) {
        PanelPlan& panel = plan.panels[i];
        const auto listed =
            std::ranges::find(plan.settings.stations, panel.id, &arbiter::StationSettings::id);
        if (listed == plan.settings.stations.end()) continue;
        panel.crc_order = listed->crc_order = modbus::CrcOrder::high_first;
    }
}

}  // namespace

Plan draw(Kind kind, std::uint64_t seed, SerialMode mode) {
    Random random(seed * 31 + static_cast<std::uint64_t>(kind));
    Plan plan;
    plan.seed = seed;
    plan.limit = row_of(kind)->limit;
    plan.settings.serial.mode = mode;
    if (mode == SerialMode::ascii) plan.settings.serial.data_bits = 7;
    draw_line(random, plan);
    if (is_of_sound_panels(kind)) {
        draw_sound(random, plan, kind);
    } else {
        draw_faulty(random, plan, kind);
    }
    if (seed % 4 == 3 && mode == SerialMode::rtu) mix_crc_orders(plan);
    return plan;
}

}  // namespace panelgate::scenario
