#include "panelgate/points/station_points.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/points/station_polls.hpp"

namespace panelgate::points::station_points_test {
namespace {

using modbus::Table;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr TimePoint kStart{2h};

std::vector<Point> temperature_and_state() {
    std::vector<Point> points(2);
    points[0].name = "temperature";
    points[0].address = 100;
    points[0].type = Type::i16;
    points[0].scale = 0.1;
    points[1].name = "state";
    points[1].address = 101;
    points[1].labels = {{1, "running"}};
    points[1].no_value = {0xFFFF};
    return points;
}

/// Polls everything twice: 21.5 degrees, this state, and a block of eight registers.
void poll(StationPolls& polls, TimePoint& now, std::uint16_t state) {
    for (int i = 0; i < 2; ++i) {
        now = std::max(now, *polls.next_due());
        while (const auto due = polls.take_due(now)) {
            const Bytes reply = due->request.pdu()[2] == 100
                                    ? Writer().u8(3).u8(4).u16(215).u16(state).take()
                                    : Writer().u8(3).u8(16).raw(Bytes(16)).take();
            polls.on_answer(now, due->read, reply, now);
        }
    }
}

TEST(StationPoints, ShowsValuesWithQualityAndAge) {
    const std::vector<Point> points = temperature_and_state();
    std::vector<Poll> blocks(1);
    blocks[0].address = 300;
    blocks[0].count = 8;
    const auto wants = wants_of(points, blocks);
    ASSERT_EQ(wants.size(), 3u);
    EXPECT_EQ(wants[2].span.count, 8u);
    StationPolls polls(wants, make_plan_limits(profile::PanelProfile(), SerialFormat{}, 2ms),
                       kStart);
    const StationPoints station(points, blocks, polls);
    const Point& temperature = *station.find("temperature");
    EXPECT_EQ(station.read(temperature, kStart).quality, Quality::bad);
    EXPECT_FALSE(station.read(temperature, kStart).age);
    EXPECT_EQ(station.find("pressure"), nullptr);

    TimePoint now = kStart;
    poll(polls, now, 1);
    const PointReading reading = station.read(temperature, now + 500ms);
    EXPECT_EQ(reading.quality, Quality::good);
    EXPECT_EQ(*reading.value, Value(21.5));
    EXPECT_GE(*reading.age, Duration(500ms));
    EXPECT_EQ(station.read(*station.find("state"), now).label, "running");
    EXPECT_EQ(station.reading(blocks[0]).good, 1u);
    EXPECT_EQ(station.reading(blocks[0]).values.size(), 8u);
    EXPECT_EQ(station.read(temperature, now + 5s).quality, Quality::stale);
    EXPECT_TRUE(station.read(temperature, now + 5s).value) << "shown with its age";
    EXPECT_FALSE(station.read(temperature, now + 60s).value) << "P10: never old as new";
    poll(polls, now, 0xFFFF);
    poll(polls, now, 0xFFFF);
    EXPECT_EQ(station.read(*station.find("state"), now).quality, Quality::bad) << "means no value";
}

TEST(StationPoints, IsOutdatedBehindAWriteUntilItIsReadAgain) {
    const std::vector<Point> points(1);
    const std::vector<Poll> blocks;
    std::vector<Reading> readings(1);
    const StationPoints station(points, blocks, readings);
    readings[0].written = kStart + 1s;
    EXPECT_FALSE(station.is_outdated(points[0])) << "there is no value";
    readings[0].sampled = kStart;
    EXPECT_TRUE(station.is_outdated(points[0]));
    readings[0].sampled = kStart + 2s;
    EXPECT_FALSE(station.is_outdated(points[0]));
}

/// temperature (a number, every second), running (a bit), name (a text).
class StationHistoryTest : public testing::Test {
  protected:
    StationHistoryTest() {
        points[0].type = Type::i16;
        points[1].type = Type::boolean;
        points[2].type = Type::string;
        for (std::size_t i = 0; i < points.size(); ++i) points[i].name = std::to_string(i);
    }
    void good(std::size_t index, Value value, Duration at, Duration age = {}) {
        const PointReading reading{std::move(value), {}, Quality::good, age};
        history.record(kStart + at, points[index], reading);
    }
    void bad(Duration at) { history.record(kStart + at, points[0], PointReading()); }
    /// "0:21.5 1:- " at `now`: seconds since kStart, values.
    std::string samples_text(std::size_t index, Duration now) const {
        std::string text;
        for (const HistorySample& sample : history.samples(points[index], kStart + now))
            text += std::to_string((sample.at - kStart) / 1s) + ':' +
                    (sample.value ? to_string(Value(*sample.value)) : "-") + ' ';
        return text;
    }

    std::vector<Point> points = std::vector<Point>(3);
    StationHistory history{points, 1s};
};

TEST_F(StationHistoryTest, KeepsOneValueASlotAtTheTimeItWasRead) {
    good(0, 21.5, 0s);
    good(0, 22, 1900ms, 200ms);
    good(0, 23, 2100ms, 200ms);
    EXPECT_EQ(samples_text(0, 3s), "0:21.5 1:23 ");
    EXPECT_EQ(samples_text(1, 3s), "");
}

TEST_F(StationHistoryTest, P10ABadValueIsAGapAndAStaleOneNothingNew) {
    good(0, 0, 0s);
    const PointReading stale{Value(99), {}, Quality::stale, {}};
    history.record(kStart + 1s, points[0], stale);
    bad(2s);
    bad(3s);
    good(0, 4, 4s);
    EXPECT_EQ(samples_text(0, 5s), "0:0 2:- 4:4 ");
}

TEST_F(StationHistoryTest, ASilenceThatMakesBadIsAGap) {
    good(0, 1, 0s);
    good(0, 2, 10s);
    EXPECT_EQ(samples_text(0, 10s), "0:1 10:2 ") << "as old as a stale value may be";
    good(0, 3, 30s);
    EXPECT_EQ(samples_text(0, 30s), "0:1 10:2 11:- 30:3 ");
    EXPECT_EQ(samples_text(0, 41s), "0:1 10:2 11:- 30:3 31:- ") << "and it goes on";
}

TEST_F(StationHistoryTest, BitsAre0And1AndTextsAreNotKept) {
    good(1, true, 0s);
    good(1, false, 1s);
    good(2, std::string("abc"), 0s);
    EXPECT_EQ(samples_text(1, 1s), "0:1 1:0 ");
    EXPECT_EQ(samples_text(2, 1s), "");
    EXPECT_FALSE(StationHistory::keeps(points[2]));
}

TEST_F(StationHistoryTest, ForgetsWhatIsOlderThanAnHour) {
    for (int i = 0; i < 4000; ++i) good(0, i, i * 1s);
    const auto samples = history.samples(points[0], kStart + 3999s);
    ASSERT_EQ(samples.size(), 3600u);
    EXPECT_EQ(samples.front().value, 400);
    EXPECT_EQ(samples.back().value, 3999);
}

TEST_F(StationHistoryTest, ItsSlotsGrowWithTheNumberOfPointsAndBoundTheirMemory) {
    EXPECT_EQ(StationHistory::width_for(582), 1s);
    EXPECT_EQ(StationHistory::width_for(583), 2s);
    EXPECT_EQ(StationHistory::width_for(2912), 5s);
    for (const std::size_t count : {1u, 1000u, 50'000u, 300'000u})
        EXPECT_LE(count * slots_of(StationHistory::kSpan, StationHistory::width_for(count)) *
                      SlotRings::kBytes,
                  StationHistory::kBytes)
            << count;
}

TEST_F(StationHistoryTest, ThePastOfPointsThatAreTheSameGoesOn) {
    good(0, 5, 1s);
    std::vector<Point> others{points[1], points[0]};
    StationHistory next(others, 1s);
    next.adopt(history);
    EXPECT_EQ(next.samples(others[1], kStart + 2s).size(), 1u);
    EXPECT_TRUE(next.samples(others[0], kStart + 2s).empty());
    others[1].scale = 2;
    StationHistory scaled(others, 1s);
    scaled.adopt(history);
    EXPECT_TRUE(scaled.samples(others[1], kStart + 2s).empty()) << "it means something else";
}

/// Requested at this time, answered 10 ms later; without a reply, silent.
tap::Transaction heard(Duration at, std::string_view request, std::string_view reply) {
    tap::Transaction made;
    made.station = 5;
    made.request = *from_hex(request);
    made.reply = *from_hex(reply);
    made.end = reply.empty() ? tap::End::silent : tap::End::answered;
    made.asked = made.sampled = kStart + at;
    made.sent = made.asked + 2ms;
    made.ended = made.asked + 10ms;
    return made;
}

/// Register 100; registers 102 and 103; coil 7.
class HeardValuesTest : public testing::Test {
  protected:
    using Changed = std::vector<std::size_t>;

    Changed hear(Duration at, std::string_view request, std::string_view reply) {
        return values.on_heard(heard(at, request, reply));
    }
    Quality quality(std::size_t want, Duration at) const {
        return quality_of(values.readings()[want], 1s, kStart + at);
    }
    const std::vector<std::uint16_t>& items(std::size_t want) const {
        return values.readings()[want].values;
    }

    HeardValues values{{{{Table::holding_registers, 100, 1}, 1s},
                        {{Table::holding_registers, 102, 2}, 1s},
                        {{Table::coils, 7, 1}, 1s}}};
};

TEST_F(HeardValuesTest, AReadThatCoversAWholeWantIsItsValue) {
    EXPECT_THAT(hear(0ms, "03 0066 0001", "03 02 0003"), IsEmpty()) << "half of it";
    EXPECT_FALSE(values.readings()[1].sampled);
    EXPECT_THAT(hear(0ms, "03 0064 0004", "03 08 0001 0002 0003 0004"), ElementsAre(0, 1));
    EXPECT_THAT(items(0), ElementsAre(1));
    EXPECT_THAT(items(1), ElementsAre(3, 4));
    EXPECT_EQ(values.readings()[1].sampled, kStart);
    EXPECT_EQ(quality(0, 1s), Quality::good);
    EXPECT_EQ(quality(0, 5s), Quality::stale);
    EXPECT_EQ(quality(2, 1s), Quality::bad);
}

TEST_F(HeardValuesTest, AConfirmedWriteIsAValueToo) {
    hear(0ms, "06 0064 0007", "06 0064 0007");
    EXPECT_THAT(items(0), ElementsAre(7));
    hear(1ms, "10 0066 0002 04 0008 0009", "10 0066 0002");
    EXPECT_THAT(items(1), ElementsAre(8, 9));
    hear(2ms, "05 0007 FF00", "05 0007 FF00");
    EXPECT_THAT(items(2), ElementsAre(1));
    hear(3ms, "0F 0006 0003 01 05", "0F 0006 0003");
    EXPECT_THAT(items(2), ElementsAre(0));
    EXPECT_EQ(quality(2, 10ms), Quality::good);
    hear(4ms, "17 0064 0004 0064 0001 02 00FF", "17 08 00FF 0002 0003 0004");
    EXPECT_THAT(items(0), ElementsAre(0xFF)) << "read and write in one reads behind its write";
    EXPECT_EQ(quality(0, 100ms), Quality::good);
}

TEST_F(HeardValuesTest, AWriteThatNobodyConfirmsMakesTheValueOld) {
    hear(0ms, "03 0064 0001", "03 02 0001");
    EXPECT_THAT(hear(100ms, "06 0064 0007", ""), testing::Contains(0));
    EXPECT_EQ(quality(0, 200ms), Quality::stale);
    EXPECT_THAT(items(0), ElementsAre(1));
    hear(300ms, "03 0064 0001", "03 02 0007");
    EXPECT_EQ(quality(0, 400ms), Quality::good);
    hear(500ms, "06 0064 0009", "86 02");  // refused: nothing was written
    EXPECT_EQ(quality(0, 600ms), Quality::good);
    tap::Transaction broadcast = heard(700ms, "06 0064 0007", "");
    broadcast.station = 0;
    broadcast.end = tap::End::unasked;
    values.on_heard(broadcast);
    EXPECT_EQ(quality(0, 800ms), Quality::stale);
}

TEST_F(HeardValuesTest, WhatIsInDoubtOrContradictsItselfIsNoValue) {
    tap::Transaction read = heard(0ms, "03 0064 0001", "03 02 0001");
    read.doubtful = true;
    EXPECT_THAT(values.on_heard(read), IsEmpty());
    EXPECT_THAT(hear(0ms, "10 0066 0002 02 0008", "10 0066 0002"), IsEmpty());
    EXPECT_THAT(hear(0ms, "41 01", "41 02"), IsEmpty());
    EXPECT_THAT(hear(0ms, "03", "03"), IsEmpty());
    hear(50ms, "03 0064 0001", "03 02 0001");
    tap::Transaction write = heard(100ms, "06 0064 0007", "06 0064 0007");
    write.doubtful = true;
    values.on_heard(write);
    EXPECT_THAT(items(0), ElementsAre(1));
    EXPECT_EQ(quality(0, 200ms), Quality::stale);
}

TEST_F(HeardValuesTest, AReadThatFailsMakesItsWantsStale) {
    hear(0ms, "03 0064 0001", "03 02 0001");
    EXPECT_THAT(hear(100ms, "03 0064 0001", ""), ElementsAre(0));
    EXPECT_EQ(quality(0, 200ms), Quality::stale);
    hear(300ms, "03 0064 0001", "83 02");
    EXPECT_EQ(values.readings()[0].exception, 2);
}

}  // namespace
}  // namespace panelgate::points::station_points_test
