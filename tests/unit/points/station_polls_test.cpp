#include "panelgate/points/station_polls.hpp"

#include <gtest/gtest.h>

#include "panelgate/base/bytes.hpp"

namespace panelgate::points::station_polls_test {
namespace {

using modbus::Table;

constexpr TimePoint kStart{1h};

PlanLimits limits() { return make_plan_limits(profile::PanelProfile(), SerialFormat{}, 2ms); }

std::uint16_t word(ByteView pdu, std::size_t at) {
    return static_cast<std::uint16_t>(pdu[at] * 256 + pdu[at + 1]);
}

/// A panel whose registers hold their own address.
Bytes reply_to(ByteView pdu) {
    Writer out;
    out.u8(pdu[0]).u8(2u * word(pdu, 3));
    for (unsigned i = 0; i < word(pdu, 3); ++i) out.u16(word(pdu, 1) + i);
    return out.take();
}

Want registers(std::uint32_t address, std::uint32_t count = 1, Duration every = 1s) {
    return {{Table::holding_registers, address, count}, every};
}

/// Runs `span` of time; reads are answered at once.
template <class Answer>
std::vector<Bytes> play(StationPolls& polls, TimePoint from, Duration span, const Answer& answer) {
    std::vector<Bytes> asked;
    TimePoint now = from;
    while (const auto next = polls.next_due()) {
        now = std::max(now, *next);
        if (now >= from + span) break;
        for (const auto& due : polls.take_due(now)) {
            asked.push_back(due.request.pdu());
            polls.on_answer(now + 5ms, due.read, answer(due.request.pdu()), now);
        }
    }
    return asked;
}

TEST(StationPolls, ReadsWhatIsWantedAndKeepsItWithItsAge) {
    StationPolls polls({registers(100), registers(101, 2), registers(103)}, limits(), kStart);
    const auto asked =
        play(polls, kStart, 10s, [](const Bytes& pdu) { return Result<Bytes>(reply_to(pdu)); });
    EXPECT_EQ(asked.size(), 10u) << "three wants side by side are one read";
    EXPECT_EQ(polls.reading(1).values, (std::vector<std::uint16_t>{101, 102}));
    ASSERT_TRUE(polls.reading(2).sampled);
    EXPECT_EQ(quality_of(polls.reading(2), 1s, kStart + 10s), Quality::good);
    EXPECT_EQ(polls.reading(2).good, 10u);
}

TEST(StationPolls, P10AStationThatFailsIsStaleThenBadAndNeverOldAsNew) {
    StationPolls polls({registers(7)}, limits(), kStart);
    play(polls, kStart, 2s, [](const Bytes& pdu) { return Result<Bytes>(reply_to(pdu)); });
    const auto silent = [](const Bytes&) { return Result<Bytes>(Fault::timeout); };
    play(polls, kStart + 2s, 1s, silent);
    const Reading& reading = polls.reading(0);
    EXPECT_TRUE(reading.failing);
    EXPECT_EQ(quality_of(reading, 1s, kStart + 3s), Quality::stale);
    EXPECT_LT(*reading.sampled, kStart + 2s) << "its age grows";
    play(polls, kStart + 3s, 12s, silent);
    EXPECT_EQ(quality_of(reading, 1s, kStart + 15s), Quality::bad);
    play(polls, kStart + 15s, 2s, [](const Bytes& pdu) { return Result<Bytes>(reply_to(pdu)); });
    EXPECT_EQ(quality_of(reading, 1s, kStart + 17s), Quality::good);
}

TEST(StationPolls, FindsTheOneItemThatThePanelDoesNotHave) {
    std::vector<Want> wants;
    for (std::uint32_t i = 0; i < 16; ++i) wants.push_back(registers(200 + i));
    StationPolls polls(wants, limits(), kStart);
    const auto panel = [](const Bytes& pdu) {
        const bool has = word(pdu, 1) > 205 || word(pdu, 1) + word(pdu, 3) <= 205;
        return Result<Bytes>(has ? reply_to(pdu) : Bytes{0x83, 2});
    };
    play(polls, kStart, 60s, panel);
    for (std::uint32_t i = 0; i < 16; ++i) {
        if (i == 5) continue;
        EXPECT_EQ(polls.reading(i).values, std::vector<std::uint16_t>{std::uint16_t(200 + i)}) << i;
    }
    EXPECT_EQ(polls.reading(5).exception, 2);
    EXPECT_EQ(quality_of(polls.reading(5), 1s, kStart + 60s), Quality::bad);
    EXPECT_LE(polls.plan().size(), 6u) << "remembered: only the cuts around it";
}

TEST(StationPolls, AWantThatTakesSeveralReadsIsAsOldAsItsOldestPart) {
    StationPolls polls({registers(0, 200, 2s)}, limits(), kStart);
    ASSERT_EQ(polls.plan().size(), 2u);
    int answered = 0;
    play(polls, kStart, 20s, [&](const Bytes& pdu) {
        return ++answered == 1 ? Result<Bytes>(reply_to(pdu)) : Result<Bytes>(Fault::timeout);
    });
    EXPECT_FALSE(polls.reading(0).sampled) << "half of it is no value";
    play(polls, kStart + 20s, 10s, [&](const Bytes& pdu) { return Result<Bytes>(reply_to(pdu)); });
    ASSERT_TRUE(polls.reading(0).sampled);
    EXPECT_EQ(polls.reading(0).values.size(), 200u);
    EXPECT_EQ(polls.reading(0).values[199], 199);
}

TEST(StationPolls, P10WhatSomebodyWritesIsStaleAtOnceAndReadOutOfTurn) {
    StationPolls polls({registers(100, 2, 60s), registers(300, 2, 60s)}, limits(), kStart);
    const auto good = [](const Bytes& pdu) { return Result<Bytes>(reply_to(pdu)); };
    play(polls, kStart, 10s, good);
    const TimePoint left = kStart + 10s;
    const std::optional<modbus::Span> items = modbus::Span{Table::holding_registers, 101, 1};
    EXPECT_EQ(polls.on_write(left, items), std::vector<std::size_t>{0});
    EXPECT_EQ(quality_of(polls.reading(0), 60s, left), Quality::stale);
    EXPECT_EQ(quality_of(polls.reading(1), 60s, left), Quality::good);
    EXPECT_TRUE(polls.on_write(left, items).empty()) << "told once";
    EXPECT_TRUE(play(polls, left, 1s, good).empty()) << "the write is still under way";
    polls.on_written(left + 1s, items);
    EXPECT_EQ(play(polls, left + 1s, 5s, good).size(), 1u);
    EXPECT_EQ(quality_of(polls.reading(0), 60s, left + 2s), Quality::good);
    play(polls, left + 6s, 4min, good);
    EXPECT_EQ(polls.reading(0).good, polls.reading(1).good + 1) << "its own turns are as before";
}

TEST(StationPolls, P10AWriteToAnotherTableMakesEverythingStaleAndTheItemsThemselvesGoFirst) {
    std::vector<Want> wants{registers(7, 1, 1h)};
    for (std::uint32_t i = 0; i < 40; ++i) wants.push_back({{Table::coils, 1000 * i, 1}, 1h});
    StationPolls polls(wants, limits(), kStart);
    const auto good = [](const Bytes& pdu) {
        return Result<Bytes>(pdu[0] == 1 ? Bytes{1, 1, 0} : reply_to(pdu));
    };
    play(polls, kStart, 10s, good);
    const TimePoint left = kStart + 10s;
    const std::optional<modbus::Span> items = modbus::Span{Table::holding_registers, 7, 1};
    EXPECT_EQ(polls.on_write(left, items).size(), wants.size());
    polls.on_written(left, items);
    const auto at_once = play(polls, left, 1ms, good);
    ASSERT_EQ(at_once.size(), 16u) << "not all of a station at once";
    EXPECT_EQ(at_once[0][0], 3) << "the register that was written";
    const auto later = play(polls, left + 1ms, 1min, good);
    EXPECT_EQ(later.size(), wants.size() - 16) << "the others a few a second, each once";
    for (std::size_t i = 0; i < wants.size(); ++i)
        EXPECT_EQ(quality_of(polls.reading(i), 1h, left + 1min), Quality::good) << i;
    EXPECT_EQ(polls.on_write(left + 1min, std::nullopt).size(), wants.size()) << "of no items: all";
}

TEST(StationPolls, P10WhereTheMemoryIsKnownAWriteMakesStaleWhatShowsItAndNothingElse) {
    const auto good = [](const Bytes& pdu) {
        return Result<Bytes>(pdu[0] == 1 ? Bytes{1, 1, 0} : reply_to(pdu));
    };
    const auto bit_and_word = [](const modbus::Span& written) {
        return std::vector<modbus::Span>{written, {Table::holding_registers, 7, 1}};
    };
    const std::optional<modbus::Span> bit = modbus::Span{Table::coils, 112, 1};
    for (const bool known : {true, false}) {
        StationPolls polls(
            {{{Table::coils, 112, 1}, 1h}, registers(7, 1, 1h), registers(900, 1, 1h)}, limits(),
            kStart, {bit_and_word, known});
        play(polls, kStart, 10s, good);
        const TimePoint left = kStart + 10s;
        EXPECT_EQ(polls.on_write(left, bit), (std::vector<std::size_t>{0, 1}));
        EXPECT_EQ(quality_of(polls.reading(2), 1h, left), Quality::good);
        polls.on_written(left + 1s, bit);
        EXPECT_EQ(play(polls, left + 1s, 5s, good).size(), known ? 2u : 3u)
            << "what may be touched for all we know is read again, too";
    }
}

TEST(StationPolls, P10AReadThatAWriteOvertakesIsOldAndAskedAgain) {
    StationPolls polls({registers(7, 1, 60s)}, limits(), kStart);
    const auto first = polls.take_due(*polls.next_due());
    const TimePoint asked = kStart + 5s;
    const std::optional<modbus::Span> items = modbus::Span{Table::holding_registers, 7, 1};
    polls.on_write(asked + 1ms, items);
    polls.on_written(asked + 2ms, items);
    ASSERT_EQ(first.size(), 1u);
    polls.on_answer(asked + 3ms, first[0].read, Bytes{3, 2, 0, 1}, asked);
    EXPECT_EQ(quality_of(polls.reading(0), 60s, asked + 3ms), Quality::stale);
    EXPECT_LE(*polls.next_due(), asked + 3ms);
    const auto again = polls.take_due(asked + 3ms);
    ASSERT_EQ(again.size(), 1u);
    polls.on_answer(asked + 9ms, again[0].read, Bytes{3, 2, 0, 2}, asked + 3ms);
    EXPECT_EQ(quality_of(polls.reading(0), 60s, asked + 9ms), Quality::good);
    EXPECT_GT(*polls.next_due(), asked + 1s);
}

TEST(StationPolls, P10WhatCannotBeReadBehindAWriteIsAskedForAgainSoon) {
    StationPolls polls({registers(7, 1, 1h)}, limits(), kStart);
    const auto good = [](const Bytes& pdu) { return Result<Bytes>(reply_to(pdu)); };
    const auto silent = [](const Bytes&) { return Result<Bytes>(Fault::timeout); };
    play(polls, kStart, 10s, good);
    const std::optional<modbus::Span> items = modbus::Span{Table::holding_registers, 7, 1};
    polls.on_write(kStart + 10s, items);
    polls.on_written(kStart + 11s, items);
    EXPECT_EQ(play(polls, kStart + 11s, 59s, silent).size(), 12u) << "at once, then every 5 s";
    EXPECT_EQ(play(polls, kStart + 70s, 10s, good).size(), 1u);
    EXPECT_EQ(quality_of(polls.reading(0), 1h, kStart + 80s), Quality::good);
    EXPECT_EQ(play(polls, kStart + 80s, 10min, silent).size(), 0u);
}

TEST(StationPolls, WhoWritesWithoutPauseGetsNoMoreThanAFewReadsASecond) {
    StationPolls polls({registers(7, 1, 60s)}, limits(), kStart);
    const std::optional<modbus::Span> items = modbus::Span{Table::holding_registers, 7, 1};
    const auto good = [](const Bytes& pdu) { return Result<Bytes>(reply_to(pdu)); };
    play(polls, kStart, 10s, good);
    std::size_t reads = 0;
    for (TimePoint now = kStart + 10s; now < kStart + 30s; now += 10ms) {
        polls.on_write(now, items);
        polls.on_written(now + 1ms, items);
        reads += play(polls, now + 1ms, 9ms, good).size();
    }
    EXPECT_GE(reads, 80u);
    EXPECT_LE(reads, 16u + 4u * 20u + 1u) << "of 2000 writes";
}

TEST(StationPolls, BitsAreZeroOrOne) {
    StationPolls polls({{{Table::coils, 0, 3}, 1s}}, limits(), kStart);
    play(polls, kStart, 2s, [](const Bytes&) { return Result<Bytes>(Bytes{1, 1, 0x05}); });
    EXPECT_EQ(polls.reading(0).values, (std::vector<std::uint16_t>{1, 0, 1}));
}

}  // namespace
}  // namespace panelgate::points::station_polls_test
