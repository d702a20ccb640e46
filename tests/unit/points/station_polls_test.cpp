#include "panelgate/points/station_polls.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/points/poller.hpp"
#include "support/fake_bus.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::points::station_polls_test {
namespace {

using modbus::Table;
using Numbers = std::vector<std::uint16_t>;
using Indices = std::vector<std::size_t>;

constexpr TimePoint kStart{1h};
constexpr TimePoint kLater = kStart + 10s;

Want registers(std::uint32_t address, std::uint32_t count = 1, Duration every = 1s) {
    return {{Table::holding_registers, address, count}, every};
}

modbus::Span item(std::uint32_t address) { return {Table::holding_registers, address, 1}; }

PlanLimits limits() { return make_plan_limits(profile::PanelProfile(), SerialFormat{}, 2ms); }

StationPolls polls_of(std::vector<Want> wants, SharedMemory memory = {}) {
    return StationPolls(std::move(wants), limits(), kStart, std::move(memory));
}

std::uint16_t word(ByteView pdu, std::size_t at) {
    return static_cast<std::uint16_t>(pdu[at] * 256 + pdu[at + 1]);
}

/// A panel whose registers hold their own address, and whose coils are off.
Result<Bytes> good(const Bytes& pdu) {
    if (pdu[0] == 1) return Bytes{1, 1, 0};
    Writer out;
    out.u8(pdu[0]).u8(2u * word(pdu, 3));
    for (unsigned i = 0; i < word(pdu, 3); ++i) out.u16(word(pdu, 1) + i);
    return out.take();
}
Result<Bytes> silent(const Bytes&) { return Fault::timeout; }

using Answer = std::function<Result<Bytes>(const Bytes&)>;

/// Runs `span` of time; reads are answered at once. Returns what was asked.
std::vector<Bytes> play(StationPolls& polls, TimePoint from, Duration span,
                        const Answer& answer = good) {
    std::vector<Bytes> asked;
    TimePoint now = from;
    while (const auto next = polls.next_due()) {
        now = std::max(now, *next);
        if (now >= from + span) break;
        if (const auto due = polls.take_due(now)) {
            asked.push_back(due->request.pdu());
            polls.on_answer(now + 5ms, due->read, answer(due->request.pdu()), now);
        }
    }
    return asked;
}

TEST(StationPolls, ReadsWhatIsWantedAndKeepsItWithItsAge) {
    StationPolls polls = polls_of({registers(100), registers(101, 2), registers(103)});
    EXPECT_EQ(play(polls, kStart, 10s).size(), 10u) << "three wants side by side are one read";
    EXPECT_EQ(polls.reading(1).values, (Numbers{101, 102}));
    ASSERT_TRUE(polls.reading(2).sampled);
    EXPECT_EQ(quality_of(polls.reading(2), 1s, kLater), Quality::good);
    EXPECT_EQ(polls.reading(2).good, 10u);
    StationPolls bits = polls_of({{{Table::coils, 0, 3}, 1s}});
    play(bits, kStart, 2s, [](const Bytes&) { return Bytes{1, 1, 0x05}; });
    EXPECT_EQ(bits.reading(0).values, (Numbers{1, 0, 1}));
}

TEST(StationPolls, P10AStationThatFailsIsStaleThenBadAndNeverOldAsNew) {
    StationPolls polls = polls_of({registers(7)});
    play(polls, kStart, 2s);
    play(polls, kStart + 2s, 1s, silent);
    const Reading& reading = polls.reading(0);
    EXPECT_TRUE(reading.failing);
    EXPECT_EQ(quality_of(reading, 1s, kStart + 3s), Quality::stale);
    EXPECT_LT(*reading.sampled, kStart + 2s) << "its age grows";
    play(polls, kStart + 3s, 12s, silent);
    EXPECT_EQ(quality_of(reading, 1s, kStart + 15s), Quality::bad);
    play(polls, kStart + 15s, 2s);
    EXPECT_EQ(quality_of(reading, 1s, kStart + 17s), Quality::good);
}

TEST(StationPolls, FindsTheOneItemThatThePanelDoesNotHave) {
    std::vector<Want> wants;
    for (std::uint32_t i = 0; i < 16; ++i) wants.push_back(registers(200 + i));
    StationPolls polls = polls_of(wants);
    play(polls, kStart, 60s, [](const Bytes& pdu) {
        const bool has = word(pdu, 1) > 205 || word(pdu, 1) + word(pdu, 3) <= 205;
        return has ? good(pdu) : Result<Bytes>(Bytes{0x83, 2});
    });
    for (std::size_t i = 0; i < wants.size(); ++i)
        if (i != 5) EXPECT_EQ(polls.reading(i).values, Numbers{std::uint16_t(200 + i)}) << i;
    EXPECT_EQ(polls.reading(5).exception, 2);
    EXPECT_EQ(quality_of(polls.reading(5), 1s, kStart + 60s), Quality::bad);
    EXPECT_LE(polls.plan().size(), 6u) << "remembered: only the cuts around it";
}

TEST(StationPolls, AWantThatTakesSeveralReadsIsAsOldAsItsOldestPart) {
    StationPolls polls = polls_of({registers(0, 200, 2s)});
    ASSERT_EQ(polls.plan().size(), 2u);
    int answered = 0;
    play(polls, kStart, 20s,
         [&](const Bytes& pdu) { return ++answered == 1 ? good(pdu) : silent(pdu); });
    EXPECT_FALSE(polls.reading(0).sampled) << "half of it is no value";
    play(polls, kStart + 20s, 10s);
    ASSERT_TRUE(polls.reading(0).sampled);
    EXPECT_EQ(polls.reading(0).values.size(), 200u);
    EXPECT_EQ(polls.reading(0).values[199], 199);
}

TEST(StationPolls, P10WhatSomebodyWritesIsStaleAtOnceAndReadOutOfTurn) {
    StationPolls polls = polls_of({registers(100, 2, 60s), registers(300, 2, 60s)});
    play(polls, kStart, 10s);
    EXPECT_EQ(polls.on_write(kLater, item(101)), Indices{0});
    EXPECT_EQ(quality_of(polls.reading(0), 60s, kLater), Quality::stale);
    EXPECT_EQ(quality_of(polls.reading(1), 60s, kLater), Quality::good);
    EXPECT_TRUE(polls.on_write(kLater, item(101)).empty()) << "told once";
    EXPECT_TRUE(play(polls, kLater, 1s).empty()) << "the write is still under way";
    polls.on_written(kLater + 1s, item(101));
    EXPECT_EQ(play(polls, kLater + 1s, 5s).size(), 1u);
    EXPECT_EQ(quality_of(polls.reading(0), 60s, kLater + 2s), Quality::good);
    play(polls, kLater + 6s, 4min);
    EXPECT_EQ(polls.reading(0).good, polls.reading(1).good + 1) << "its own turns are as before";
}

TEST(StationPolls, P10AWriteToAnotherTableMakesEverythingStaleAndTheItemsThemselvesGoFirst) {
    std::vector<Want> wants{registers(7, 1, 1h)};
    for (std::uint32_t i = 0; i < 40; ++i) wants.push_back({{Table::coils, 1000 * i, 1}, 1h});
    StationPolls polls = polls_of(wants);
    play(polls, kStart, 10s);
    EXPECT_EQ(polls.on_write(kLater, item(7)).size(), wants.size());
    polls.on_written(kLater, item(7));
    const auto at_once = play(polls, kLater, 1ms);
    ASSERT_EQ(at_once.size(), 16u) << "not all of a station at once";
    EXPECT_EQ(at_once[0][0], 3) << "the register that was written";
    EXPECT_EQ(play(polls, kLater + 1ms, 1min).size(), wants.size() - 16)
        << "the others a few a second, each once";
    for (std::size_t i = 0; i < wants.size(); ++i)
        EXPECT_EQ(quality_of(polls.reading(i), 1h, kLater + 1min), Quality::good) << i;
    EXPECT_EQ(polls.on_write(kLater + 1min, {}).size(), wants.size()) << "of no items: all";
}

TEST(StationPolls, P10WhereTheMemoryIsKnownAWriteMakesStaleWhatShowsItAndNothingElse) {
    const auto bit_and_word = [](const modbus::Span& written) {
        return std::vector<modbus::Span>{written, item(7)};
    };
    const modbus::Span bit{Table::coils, 112, 1};
    for (const bool known : {true, false}) {
        StationPolls polls = polls_of({{bit, 1h}, registers(7, 1, 1h), registers(900, 1, 1h)},
                                      {bit_and_word, known});
        play(polls, kStart, 10s);
        EXPECT_EQ(polls.on_write(kLater, bit), (Indices{0, 1}));
        EXPECT_EQ(quality_of(polls.reading(2), 1h, kLater), Quality::good);
        polls.on_written(kLater + 1s, bit);
        EXPECT_EQ(play(polls, kLater + 1s, 5s).size(), known ? 2u : 3u)
            << "what may be touched for all we know is read again, too";
    }
}

TEST(StationPolls, P10AReadThatAWriteOvertakesIsOldAndAskedAgain) {
    StationPolls polls = polls_of({registers(7, 1, 60s)});
    const auto first = polls.take_due(*polls.next_due());
    const TimePoint asked = kStart + 5s;
    polls.on_write(asked + 1ms, item(7));
    polls.on_written(asked + 2ms, item(7));
    ASSERT_TRUE(first);
    polls.on_answer(asked + 3ms, first->read, Bytes{3, 2, 0, 1}, asked);
    EXPECT_EQ(quality_of(polls.reading(0), 60s, asked + 3ms), Quality::stale);
    EXPECT_LE(*polls.next_due(), asked + 3ms);
    const auto again = polls.take_due(asked + 3ms);
    ASSERT_TRUE(again);
    polls.on_answer(asked + 9ms, again->read, Bytes{3, 2, 0, 2}, asked + 3ms);
    EXPECT_EQ(quality_of(polls.reading(0), 60s, asked + 9ms), Quality::good);
    EXPECT_GT(*polls.next_due(), asked + 1s);
}

TEST(StationPolls, P10WhatCannotBeReadBehindAWriteIsAskedForAgainSoon) {
    StationPolls polls = polls_of({registers(7, 1, 1h)});
    play(polls, kStart, 10s);
    polls.on_write(kLater, item(7));
    polls.on_written(kLater + 1s, item(7));
    EXPECT_EQ(play(polls, kStart + 11s, 59s, silent).size(), 12u) << "at once, then every 5 s";
    EXPECT_EQ(play(polls, kStart + 70s, 10s).size(), 1u);
    EXPECT_EQ(quality_of(polls.reading(0), 1h, kStart + 80s), Quality::good);
    EXPECT_EQ(play(polls, kStart + 80s, 10min, silent).size(), 0u);
}

PolledStation station(std::uint8_t id, std::vector<Want> wants) {
    return {id, std::move(wants), limits()};
}

/// Stations 5, whose register 100 holds 42, and 9, which is silent.
class PollerTest : public testing::Test {
  protected:
    PollerTest() {
        bus.script = [](const bus::Request& request) {
            return std::optional(request.station == 9 ? test::FakeBus::fault(Fault::timeout, true)
                                                      : test::FakeBus::reply({3, 2, 0, 42}));
        };
        poll({station(5, {registers(100, 1, 1ms)}), station(9, {registers(7, 1, 1ms)})});
        poller->on_update(
            [this](std::uint8_t of, const Indices& wants) { updates[of] += wants.size(); });
    }
    void poll(std::vector<PolledStation> stations) {
        poller = std::make_unique<Poller>(clock, bus, std::move(stations));
    }
    bool run_until(const std::function<bool()>& so) { return test::run_until(io, clock, so); }
    Reading reading(std::uint8_t of, std::size_t want) { return poller->find(of)->reading(want); }

    boost::asio::io_context io{1};
    test::ManualClock clock;
    test::FakeBus bus{io.get_executor()};
    std::unique_ptr<Poller> poller;
    std::map<std::uint8_t, std::size_t> updates;  ///< wants, by station
};

TEST_F(PollerTest, AsksAsPollsAndKeepsWhatComes) {
    poller->start();
    ASSERT_TRUE(run_until([&] { return updates[5] >= 3 && updates[9] >= 3; }));
    EXPECT_EQ(reading(5, 0).values, Numbers{42});
    EXPECT_TRUE(reading(9, 0).failing);
    EXPECT_EQ(poller->find(7), nullptr);
    for (const bus::Request& request : bus.requests) EXPECT_TRUE(request.poll);
    EXPECT_NE(bus.requests[0].client, bus.requests[1].client);
}

TEST_F(PollerTest, P10AWriteIsToldAtOnceAndReadAgainFromTheLoop) {
    poll({station(5, {registers(100, 1, 1h)})});
    std::vector<Quality> qualities;
    poller->on_update([&](std::uint8_t of, const Indices&) {
        qualities.push_back(quality_of(reading(of, 0), 1h, clock.now()));
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
    poller->apply({station(7, {registers(1, 1, 1ms)}), station(5, {registers(100, 1, 1ms)})});
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
    const auto sampled = reading(5, 0).sampled;
    bus.script = [](const bus::Request&) { return std::nullopt; };
    poller->apply({station(5, {registers(90, 1, 1h), registers(100, 1, 1h)})});
    EXPECT_FALSE(reading(5, 0).sampled);
    EXPECT_EQ(reading(5, 1).sampled, sampled);
    EXPECT_EQ(reading(5, 1).values, Numbers{42});
}

}  // namespace
}  // namespace panelgate::points::station_polls_test
