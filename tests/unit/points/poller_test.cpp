#include "panelgate/points/poller.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>

#include "support/fake_bus.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::points::poller_test {
namespace {

using modbus::Table;

class PollerTest : public testing::Test {
  protected:
    PollerTest() {
        bus.script = [](const bus::Request& request) {
            if (request.station == 9)
                return std::optional(test::FakeBus::fault(Fault::timeout, true));
            return std::optional(test::FakeBus::reply({3, 2, 0, 42}));
        };
        std::vector<PolledStation> stations(2);
        stations[0] = {5, {{{Table::holding_registers, 100, 1}, 1ms}}, limits()};
        stations[1] = {9, {{{Table::holding_registers, 7, 1}, 1ms}}, limits()};
        poller = std::make_unique<Poller>(clock, bus, std::move(stations));
        poller->on_update([this](std::uint8_t station, const std::vector<std::size_t>& wants) {
            updates[station] += wants.size();
        });
    }
    static PlanLimits limits() {
        return make_plan_limits(profile::PanelProfile(), SerialFormat{}, 2ms);
    }

    bool run_until(const std::function<bool()>& so) { return test::run_until(io, clock, so); }

    boost::asio::io_context io{1};
    test::ManualClock clock;
    test::FakeBus bus{io.get_executor()};
    std::unique_ptr<Poller> poller;
    std::map<std::uint8_t, std::size_t> updates;  ///< wants, by station
};

TEST_F(PollerTest, AsksAsPollsAndKeepsWhatComes) {
    poller->start();
    ASSERT_TRUE(run_until([&] { return updates[5] >= 3 && updates[9] >= 3; }));
    EXPECT_EQ(poller->find(5)->reading(0).values, std::vector<std::uint16_t>{42});
    EXPECT_TRUE(poller->find(9)->reading(0).failing);
    EXPECT_EQ(poller->find(7), nullptr);
    for (const bus::Request& request : bus.requests) EXPECT_TRUE(request.poll);
    EXPECT_NE(bus.requests[0].client, bus.requests[1].client);
}

TEST_F(PollerTest, P10AWriteIsToldAtOnceAndReadAgainFromTheLoop) {
    std::vector<PolledStation> stations(1);
    stations[0] = {5, {{{Table::holding_registers, 100, 1}, 1h}}, limits()};
    poller = std::make_unique<Poller>(clock, bus, std::move(stations));
    std::vector<Quality> qualities;
    poller->on_update([&](std::uint8_t station, const std::vector<std::size_t>&) {
        qualities.push_back(quality_of(poller->find(station)->reading(0), 1h, clock.now()));
    });
    const auto listener = poller->write_listener();
    poller->start();
    ASSERT_TRUE(run_until([&] { return qualities.size() == 1; }));
    clock.pass(1s);
    bus::WriteEvent write{0, modbus::Span{Table::holding_registers, 99, 3}, false};
    listener(write);
    ASSERT_EQ(qualities.size(), 2u);
    EXPECT_EQ(qualities[1], Quality::stale);
    write.ended = true;
    listener(write);
    EXPECT_EQ(bus.requests.size(), 1u) << "asked from inside the bus";
    ASSERT_TRUE(run_until([&] { return qualities.size() == 3; }));
    EXPECT_EQ(qualities[2], Quality::good);
    EXPECT_EQ(bus.requests.size(), 2u);
    write.station = 6;
    write.ended = false;
    listener(write);
    poller.reset();
    write.station = 0;
    listener(write);
    EXPECT_EQ(qualities.size(), 3u) << "another station's, or nobody's any more";
}

TEST_F(PollerTest, TakesBackWhatWaitsWhenItStops) {
    bus.script = [](const bus::Request&) { return std::nullopt; };
    poller->start();
    ASSERT_TRUE(run_until([&] { return bus.open() == 2; }));
    poller->stop();
    EXPECT_EQ(bus.cancelled.size(), 2u);
    EXPECT_FALSE(run_until([] { return false; })) << "something goes on";
    EXPECT_EQ(updates[5] + updates[9], 0u);
}

TEST_F(PollerTest, AnotherSetOfStationsLeavesThoseThatAreTheSameAlone) {
    poller->start();
    ASSERT_TRUE(run_until([&] { return updates[5] >= 2; }));
    const auto before = poller->find(5);
    const bus::ClientId client = bus.requests[0].client;
    std::vector<PolledStation> stations(2);
    stations[0] = {7, {{{Table::holding_registers, 1, 1}, 1ms}}, limits()};
    stations[1] = {5, {{{Table::holding_registers, 100, 1}, 1ms}}, limits()};
    poller->apply(std::move(stations));
    EXPECT_EQ(poller->find(5), before);
    EXPECT_EQ(poller->find(9), nullptr);
    EXPECT_EQ(bus.cancelled.size(), 1u) << "what 9 had waiting";
    updates.clear();
    ASSERT_TRUE(run_until([&] { return updates[5] >= 2 && updates[7] >= 2; }));
    EXPECT_EQ(updates.count(9), 0u);
    EXPECT_EQ(bus.requests[0].client, client);
}

TEST_F(PollerTest, P10WhatIsKnownOfItemsThatAreStillWantedStaysKnown) {
    poller->start();
    ASSERT_TRUE(run_until([&] { return updates[5] >= 1; }));
    const auto sampled = poller->find(5)->reading(0).sampled;
    bus.script = [](const bus::Request&) { return std::optional<bus::Answer>(); };
    std::vector<PolledStation> stations(1);
    stations[0] = {
        5,
        {{{Table::holding_registers, 90, 1}, 1h}, {{Table::holding_registers, 100, 1}, 1h}},
        limits()};
    poller->apply(std::move(stations));
    EXPECT_FALSE(poller->find(5)->reading(0).sampled);
    EXPECT_EQ(poller->find(5)->reading(1).sampled, sampled);
    EXPECT_EQ(poller->find(5)->reading(1).values, std::vector<std::uint16_t>{42});
}

}  // namespace
}  // namespace panelgate::points::poller_test
