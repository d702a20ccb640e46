#include <algorithm>
#include <utility>

#include "draw.hpp"

namespace panelgate::scenario {

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

/// So that what dead panels cost is seen.
void draw_healthy_load(Plan& plan) {
    ClientPlan steady;
    steady.in_flight = 2;
    steady.writes = 0;
    steady.pause = 0us;
    steady.stations = {plan.panels.front().id};
    plan.panels.front() = plain_panel(plan.panels.front().id);
    plan.clients.push_back(steady);
}

/// Up to 40 connections of one address with 16 requests each, beside single ones that have time.
void draw_flood(Random& random, Plan& plan) {
    arbiter::Settings& s = plan.settings;
    s.queue.limit = random.between(16, 256);
    s.queue.per_client = random.between(4, 32);
    s.queue.deadline = random.between(4s, 8s);
    const unsigned flooding = random.between(5, 40);
    plan.clients.clear();
    std::vector<std::uint8_t> all;
    for (const PanelPlan& panel : plan.panels) all.push_back(panel.id);
    const bool equal = random.chance(0.3);
    const double writes = random.chance(0.5) ? random.share() * 0.5 : 0;
    for (unsigned i = 0; i < flooding; ++i) {
        ClientPlan client;
        client.in_flight = 16;
        client.writes = equal ? 0 : writes;
        client.same_read = equal;
        client.host = 1;
        client.stations = all;
        plan.clients.push_back(std::move(client));
    }
    const unsigned polite = random.between(1, 5);
    for (unsigned i = 0; i < polite; ++i) {
        ClientPlan client;
        client.writes = random.chance(0.5) ? 0.3 : 0;
        client.pause = 20ms;
        client.host = 2 + i;
        client.polite = true;
        client.stations = all;
        plan.clients.push_back(std::move(client));
    }
}

/// Endless writes, and readers that ask for one thing at a time.
void draw_writers(Random& random, Plan& plan) {
    plan.clients.clear();
    std::vector<std::uint8_t> all;
    for (const PanelPlan& panel : plan.panels) all.push_back(panel.id);
    const unsigned writers = random.between(1, 4);
    for (unsigned i = 0; i < writers; ++i) {
        ClientPlan client;
        client.in_flight = random.between(4, 16);
        client.writes = 1;
        client.pause = 0us;
        client.vanish = random.chance(0.3) ? 0.05 : 0;
        client.stations = all;
        plan.clients.push_back(std::move(client));
    }
    const unsigned readers = random.between(1, 3);
    for (unsigned i = 0; i < readers; ++i) {
        ClientPlan client;
        client.writes = 0;
        client.stations = all;
        plan.clients.push_back(std::move(client));
    }
}

}  // namespace panelgate::scenario
