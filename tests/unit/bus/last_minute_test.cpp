#include "panelgate/bus/last_minute.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace panelgate::bus::last_minute_test {
namespace {

/// A line with one panel, asked by two machines and a poll.
struct Plant {
    LineReport report;
    std::vector<ClientShare> clients;
    TimePoint now{1h};
    LastMinute minute;

    Plant() {
        report.stations.emplace_back().station = "press";
        clients.resize(4);
        clients[0].name = "modbus_tcp 10.0.0.7:5000";
        clients[0].address = "10.0.0.7";
        clients[1].name = "modbus_tcp 10.0.0.7";  // has left
        clients[1].address = "10.0.0.7";
        clients[2].name = "http 2001:db8::5";
        clients[2].address = "2001:db8::5";
        clients[3].name = "poll of press";
    }
    void ask(std::size_t client, Outcome outcome, Duration wire) {
        ++report.stations[0].requests[3][outcome];
        if (outcome == Outcome::ok) report.stations[0].wire.bus_transaction.observe(wire);
        report.wire.busy += wire;
        clients[client].busy += wire;
        ++clients[client].requests;
    }
    void pass(Duration time) {
        for (; time > Duration::zero(); time -= LastMinute::kStep) {
            now += LastMinute::kStep;
            minute.record(now, report, clients);
        }
    }
    MinuteUse use() const { return minute.use(now, report, clients); }
};

TEST(LastMinute, IsOfTheLastMinuteAndNotOfAllTime) {
    Plant plant;
    plant.minute.record(plant.now, plant.report, plant.clients);
    for (int i = 0; i < 100; ++i) plant.ask(1, Outcome::ok, 7ms);
    plant.pass(2min);
    EXPECT_TRUE(plant.use().hosts.empty()) << "the client has gone two minutes ago";
    for (int i = 0; i < 10; ++i) plant.ask(2, Outcome::ok, 300ms);
    plant.ask(0, Outcome::timeout, 1s);
    const MinuteUse use = plant.use();
    EXPECT_EQ(use.span, Duration(60s));
    EXPECT_NEAR(use.load_percent, 100 * 4.0 / 60, 0.01);
    EXPECT_EQ(use.all.requests, 11U);
    EXPECT_EQ(use.all.errors, 1U);
    EXPECT_NEAR(use.stations.at("press").wire, 3, 0.001);
    EXPECT_EQ(use.stations.at("press").transactions, 10U);
    ASSERT_EQ(use.hosts.size(), 2U);
    EXPECT_EQ(use.hosts[0].name, "2001:db8::/64");
    EXPECT_EQ(use.hosts[0].percent, 75);
    EXPECT_EQ(use.hosts[1].name, "10.0.0.7");
    EXPECT_EQ(use.hosts[1].requests, 1U);
}

TEST(LastMinute, AClientThatLeavesIsStillOfItsAddress) {
    Plant plant;
    for (int i = 0; i < 100; ++i) plant.ask(0, Outcome::ok, 7ms);
    plant.pass(2min);
    std::swap(plant.clients[0].requests, plant.clients[1].requests);
    std::swap(plant.clients[0].busy, plant.clients[1].busy);
    EXPECT_TRUE(plant.use().hosts.empty());
}

TEST(LastMinute, RefusesIfNoTurnWasFoundAllTheMinute) {
    Plant plant;
    plant.minute.record(plant.now, plant.report, plant.clients);
    for (int i = 0; i < 6; ++i) {
        EXPECT_FALSE(plant.use().refuses) << i;
        plant.ask(0, i % 2 == 0 ? Outcome::busy : Outcome::expired, 0ms);
        plant.pass(10s);
    }
    EXPECT_TRUE(plant.use().refuses);
    EXPECT_EQ(plant.use().all.no_turn, 6U);
    plant.pass(10s);
    EXPECT_FALSE(plant.use().refuses) << "ten seconds without";
}

TEST(LastMinute, OfAYoungLineIsShorter) {
    Plant plant;
    EXPECT_EQ(plant.use().span, Duration::zero());
    plant.minute.record(plant.now, plant.report, plant.clients);
    plant.now += 5s;
    plant.ask(0, Outcome::ok, 1s);
    EXPECT_EQ(plant.use().span, Duration(5s));
    EXPECT_EQ(plant.use().load_percent, 20);
}

}  // namespace
}  // namespace panelgate::bus::last_minute_test
