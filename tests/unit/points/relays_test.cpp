#include "panelgate/points/relays.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/fake_bus.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::points::relays_test {
namespace {

using modbus::Table;
using test::FakeBus;
using Texts = std::vector<std::string>;

const bus::Answer kSilence = FakeBus::fault(Fault::timeout, true);

/// Copies two registers from address 100 of one line to address 200 of station 20 on "floor1".
class RelaysTest : public testing::Test {
  protected:
    RelayRoute route_to(std::uint16_t address, bool on_change, std::uint32_t count = 2) {
        RelayRoute route;
        route.relay.from = {"press", "UW100", Table::holding_registers, 100};
        route.relay.to = {"oven", "GDT200", Table::holding_registers, address};
        route.relay.count = count;
        route.relay.every = every;
        route.relay.on_change = on_change;
        route.from = &from;
        route.to = &to;
        route.from_station = 31;
        route.to_station = 20;
        route.to_line = "floor1";
        route.to_memory.shown_as = [](const modbus::Span& items) {
            return std::vector{items, modbus::Span{Table::holding_registers, items.first / 16u, 1}};
        };
        return route;
    }
    void make(bool on_change, std::uint32_t count = 2) {
        from.script = [this](const bus::Request&) { return source; };
        to.script = [this](const bus::Request&) { return target; };
        relays = std::make_unique<Relays>(clock, std::vector{route_to(200, on_change, count)});
        relays->on_state([this](const RelayStatus& relay) { states.push_back(text_of(relay)); });
        relays->start();
    }
    void run_until(const std::function<bool()>& done) {
        ASSERT_TRUE(test::run_until(io, clock, done)) << "nothing is left to happen";
    }
    void turns(std::uint64_t more) {
        const std::uint64_t enough = status().reads + more;
        run_until([&] { return status().reads >= enough; });
        io.restart();
        io.poll();
    }
    void first_turn(Duration interval) {
        every = interval;
        make(true);
        turns(1);
    }
    /// Another client writes this register on the target's line.
    void written(std::uint8_t station, std::uint16_t address) {
        const modbus::Span items{Table::holding_registers, address, 1};
        relays->write_listener()("floor1", {station, items, false, 99});
    }
    RelayStatus status() { return relays->status().at(0); }

    Duration every = 1ms;
    boost::asio::io_context io{1};
    test::ManualClock clock;
    FakeBus from{io.get_executor()};
    FakeBus to{io.get_executor()};
    const bus::Answer confirmed = FakeBus::reply("10 00 C8 00 02"_hex);
    std::optional<bus::Answer> source = FakeBus::reply("03 04 00 01 00 02"_hex);
    std::optional<bus::Answer> target = confirmed;
    Texts states;
    std::unique_ptr<Relays> relays;
};

TEST_F(RelaysTest, WritesWhatItHasJustRead) {
    make(false);
    run_until([&] { return status().writes >= 3; });
    EXPECT_EQ(from.requests[0].request.pdu(), "03 00 64 00 02"_hex);
    EXPECT_EQ(to.requests[0].request.pdu(), "10 00 C8 00 02 04 00 01 00 02"_hex);
    EXPECT_EQ(to.requests[0].station, 20);
    EXPECT_TRUE(to.requests[0].poll);
    EXPECT_EQ(states, Texts{"ok"});
    EXPECT_EQ(status().name, "press/UW100 to oven/GDT200");
}

TEST_F(RelaysTest, OnChangeWritesOnlyWhatIsNewAndEverythingAgainEveryRefresh) {
    first_turn(1s);
    turns(4);
    EXPECT_EQ(to.requests.size(), 1u);
    source = FakeBus::reply("03 04 00 01 00 03"_hex);
    turns(1);
    ASSERT_EQ(to.requests.size(), 2u);
    EXPECT_EQ(to.requests[1].request.pdu(), "10 00 C8 00 02 04 00 01 00 03"_hex);
    for (const std::size_t before : {2u, 3u}) {
        turns(59);
        EXPECT_EQ(to.requests.size(), before);
        turns(1);
        EXPECT_EQ(to.requests.size(), before + 1) << "the target may have lost its memory";
    }
    EXPECT_EQ(states, Texts{"ok"});
}

TEST_F(RelaysTest, OnChangeWritesAgainWhenTheTargetMayHaveBeenRestartedUnseen) {
    make(true);
    turns(5);
    EXPECT_EQ(to.requests.size(), 1u);
    to.stations[20] = {Health::online, {}, 1};
    turns(5);
    EXPECT_EQ(to.requests.size(), 2u) << "it was silent between two turns";
    to.stations[20].returns = 2;
    target = kSilence;
    turns(3);
    EXPECT_EQ(to.requests.size(), 5u) << "until it is confirmed";
    target = confirmed;
    turns(5);
    EXPECT_EQ(to.requests.size(), 6u);
}

TEST_F(RelaysTest, ATargetThatHasGoneIsSeenThoughNothingChangesAndWrittenWhenItIsBack) {
    make(true);
    run_until([&] { return status().writes == 1; });
    to.line.up = false;
    run_until([&] { return states.size() == 2; });
    EXPECT_EQ(states[1], "target failing: line_down");
    to.line.up = true;
    run_until([&] { return status().writes >= 2; });
    run_until([&] { return states.back() == "ok"; });
    to.stations[20] = {Health::offline, {}};
    run_until([&] { return states.back() == "target failing: offline"; });
}

TEST_F(RelaysTest, WithoutAFreshValueNothingIsWrittenAndTheStateTellsWhy) {
    make(false, 200);
    run_until([&] { return status().read_failures >= 3; });
    EXPECT_TRUE(from.requests.empty()) << "no reply holds that many";
    source = kSilence;
    make(false);
    run_until([&] { return status().read_failures >= 3; });
    source = FakeBus::reply("83 02"_hex);
    run_until([&] { return states.size() == 3; });
    EXPECT_TRUE(to.requests.empty());
    EXPECT_EQ(states, (Texts{"source failing: refused", "source failing: timeout",
                             "source failing: exception 2"}));
}

TEST_F(RelaysTest, AWriteThatFailedIsTriedAgainThoughNothingChanged) {
    target = FakeBus::fault(Fault::offline, false);
    make(true);
    run_until([&] { return status().write_failures >= 2; });
    EXPECT_EQ(states, Texts{"target failing: offline"});
    target = confirmed;
    run_until([&] { return status().writes == 1; });
    EXPECT_EQ(status().state, RelayState::ok);
}

TEST_F(RelaysTest, WhatSomebodyElseWroteToTheTargetIsWrittenOverAtOnce) {
    first_turn(30s);
    const TimePoint before = clock.now();
    written(20, 201);
    run_until([&] { return status().writes == 2; });
    EXPECT_EQ(clock.now(), before) << "and not at the next turn";
    EXPECT_EQ(status().repairs, 1u);
    turns(2);
    EXPECT_EQ(status().writes, 2u) << "it holds that now";
}

TEST_F(RelaysTest, FightsOverATargetOnceASecondAtMost) {
    first_turn(30s);
    const TimePoint before = clock.now();
    while (status().writes < 5) {
        written(0, 200);
        const auto now = status().writes;
        run_until([&] { return status().writes > now; });
    }
    EXPECT_GE(clock.now() - before, 3s);
    EXPECT_LT(clock.now() - before, 4s);
    EXPECT_EQ(status().repairs, 4u);
}

TEST_F(RelaysTest, FightsNoMoreWhenItsTurnsAreShort) {
    first_turn(20ms);
    const TimePoint before = clock.now();
    while (clock.now() - before < 2500ms) {
        written(20, 200);
        turns(1);
    }
    EXPECT_EQ(status().repairs, 3u);
    EXPECT_EQ(status().writes, 4u);
}

TEST_F(RelaysTest, AWriteThatLeavesTheTargetAloneIsNoneOfItsBusiness) {
    first_turn(30s);
    const std::uint64_t reads = status().reads;
    const auto tell = relays->write_listener();
    const modbus::Span first{Table::holding_registers, 200, 1};
    written(20, 202);
    written(21, 200);
    tell("floor2", {20, first, false, 99});
    tell("floor1", {20, modbus::Span{Table::coils, 16, 1}, false, 99});
    tell("floor1", {20, first, false, to.requests[0].client});
    turns(1);
    EXPECT_EQ(status().reads, reads + 1);
    EXPECT_EQ(to.requests.size(), 1u);
    tell("floor1", {20, modbus::Span{Table::coils, 200 * 16, 1}, false, 99});
    run_until([&] { return status().repairs == 1; });
}

TEST_F(RelaysTest, AWriteOfItsOwnThatWaitsBehindAnotherRepairsThat) {
    every = 30s;
    target.reset();
    make(true);
    run_until([&] { return to.open() == 1; });
    written(20, 200);
    relays->write_listener()("floor1", {20, modbus::Span{Table::holding_registers, 200, 2}, false,
                                        to.requests[0].client});
    to.release(confirmed);
    turns(1);
    EXPECT_EQ(to.requests.size(), 1u);
    EXPECT_EQ(status().repairs, 1u);
}

TEST_F(RelaysTest, StopsWithWhatItHasOpen) {
    source.reset();
    make(false);
    run_until([&] { return from.open() == 1; });
    relays->stop();
    EXPECT_EQ(from.cancelled.size(), 1u);
    EXPECT_FALSE(test::run_until(io, clock, [] { return false; })) << "something goes on";
    EXPECT_TRUE(to.requests.empty());
}

TEST_F(RelaysTest, P2ARelayThatStaysWritesNothingAgainWhenAnotherComes) {
    make(true);
    run_until([&] { return status().writes == 1; });
    relays->apply({route_to(300, true), route_to(200, true)});
    run_until([&] { return relays->status()[0].writes == 1; });
    run_until([&] { return relays->status()[1].reads > 10; });
    EXPECT_EQ(relays->status()[1].writes, 1u);
    EXPECT_EQ(to.requests.size(), 2u);
    every = 2ms;
    relays->apply({route_to(300, true)});
    EXPECT_EQ(relays->status().size(), 1u);
    run_until([&] { return status().reads > 20; });
    EXPECT_EQ(to.requests.size(), 2u);
}

}  // namespace
}  // namespace panelgate::points::relays_test
