#include "house_plan.hpp"

#include <cstdlib>

#include "draw.hpp"
#include "random.hpp"

namespace panelgate::scenario {

std::string_view label(HouseKind kind) {
    switch (kind) {
        case HouseKind::calm:
            return "calm";
        case HouseKind::sound:
            return "sound";
        case HouseKind::faulty:
            return "faulty";
        case HouseKind::dead:
            return "dead";
        case HouseKind::memory:
            return "memory";
        case HouseKind::loss:
            return "loss";
        case HouseKind::master:
            return "master";
    }
    std::abort();
}

namespace {

Kind line_of(HouseKind kind, Random& random) {
    switch (kind) {
        case HouseKind::calm:
        case HouseKind::sound:
            return Kind::voices;
        case HouseKind::faulty:
            return random.chance(0.5) ? Kind::faults : Kind::station;
        case HouseKind::dead:
            return random.chance(0.5) ? Kind::dead : Kind::mass;
        case HouseKind::memory:
            return Kind::crowd;
        case HouseKind::loss:
            return Kind::loss;
        case HouseKind::master:
            return random.chance(0.5) ? Kind::voices : Kind::faults;
    }
    std::abort();
}

/// Replies come just in time, and the loop is busy meanwhile: only who reads before he looks at the
/// clock loses none.
void make_calm(Random& random, Plan& plan) {
    arbiter::Settings& s = plan.settings;
    s.queue = {};
    s.echo = EchoMode::off;
    s.unlisted.retries = 0;
    s.unlisted.response_timeout = 60ms;
    plan.line = {};
    plan.panels.clear();
    s.stations.clear();
    for (std::uint8_t id = 1; id <= 5; ++id) {
        PanelPlan panel = plain_panel(id);
        panel.eager = true;
        panel.think = random.between(30ms, 42ms);
        add_station(plan, panel);
    }
    ClientPlan client;
    client.writes = random.chance(0.5) ? 0.3 : 0;
    client.pause = random.between(0us, 20ms);
    client.stations = {1, 2, 3, 4, 5};
    plan.clients = {client};
}

/// Copies of replies are judged by the checker of the wire, which knows when they can be known.
void leave_out_copies(Plan& plan) {
    for (PanelPlan& panel : plan.panels) panel.duplicate = panel.damaged_first = 0;
}

Duration timeout_of(Random& random, Manner manner) {
    switch (manner) {
        case Manner::libmodbus:
            return random.chance(0.5) ? 500ms : random.between(300ms, 5s);
        case Manner::mbpoll:
            return 1s;
        case Manner::impatient:
            return random.between(20ms, 200ms);
    }
    std::abort();
}

/// Of its own, so that the rest of the house is what it is without.
MasterPlan draw_master(std::uint64_t seed, Duration deadline) {
    constexpr int kRates[] = {9600, 19200, 38400, 115200};
    Random random(seed ^ 0x3A57E2);
    MasterPlan master;
    master.port.settings.serial.baud = kRates[random.below(4)];
    master.port.settings.serial.parity = random.chance(0.5) ? Parity::even : Parity::none;
    master.port.line.echo = random.chance(0.3);
    master.manner = static_cast<Manner>(random.below(3));
    master.timeout = timeout_of(random, master.manner);
    master.pause = random.chance(0.5) ? random.between(2ms, 20ms) : random.between(2ms, 500ms);
    master.tells_timeout = random.chance(0.3);
    master.on_failure_exception = random.chance(0.4);
    const bool good = master.manner != Manner::impatient && random.chance(0.4);
    const auto maybe = [&](double most) { return random.chance(0.4) ? random.share() * most : 0; };
    master.writes = maybe(0.5);
    master.broadcasts = maybe(0.1);
    master.others = maybe(0.3);
    if (good) {
        master.on_failure_exception = true;
        master.timeout = deadline + random.between(400ms, Duration(1s));
        return master;
    }
    master.damaged = maybe(0.2);
    master.pieces = maybe(0.3);
    master.glitches = maybe(0.2);
    master.talks_over = master.manner == Manner::impatient ? 0.3 : maybe(0.1);
    return master;
}

}  // namespace

HousePlan draw_house(HouseKind kind, std::uint64_t seed) {
    Random random(seed * 131 + static_cast<std::uint64_t>(kind));
    HousePlan house;
    house.line = draw(line_of(kind, random), seed);
    house.calm = kind == HouseKind::calm;
    if (house.calm) make_calm(random, house.line);
    leave_out_copies(house.line);
    house.wake = random.chance(0.7) ? random.between(0us, 5ms) : random.between(5ms, 40ms);
    if (random.chance(0.3)) house.take = random.between(0us, 2s);
    for (std::size_t i = 0; i < house.line.panels.size(); ++i) {
        const Duration usual = random.chance(0.5) ? random.between(20ms, 2s) : Duration{};
        house.polled.push_back(house.calm ? Duration(1ms) : usual);
    }
    if (kind == HouseKind::master || (!house.calm && seed % 3 == 1))
        house.master = draw_master(seed, house.line.settings.queue.deadline);
    house.relay = !house.calm && house.line.panels.size() > 1 && random.chance(0.7);
    return house;
}

}  // namespace panelgate::scenario
