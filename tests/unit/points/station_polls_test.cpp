#include "panelgate/points/station_polls.hpp"

#include <gtest/gtest.h>

#include "panelgate/base/bytes.hpp"

namespace panelgate::points {
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

/// Plays `span` of time; what is read is answered at once.
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

TEST(StationPolls, BitsAreZeroOrOne) {
    StationPolls polls({{{Table::coils, 0, 3}, 1s}}, limits(), kStart);
    play(polls, kStart, 2s, [](const Bytes&) { return Result<Bytes>(Bytes{1, 1, 0x05}); });
    EXPECT_EQ(polls.reading(0).values, (std::vector<std::uint16_t>{1, 0, 1}));
}

}  // namespace
}  // namespace panelgate::points
