#include "panelgate/base/series.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace panelgate::slot_ring_test {
namespace {

using Told = std::vector<std::pair<Duration, double>>;

constexpr TimePoint kStart{100s};

/// Four slots of 10 s; times are relative to kStart.
class SlotRingTest : public testing::Test {
  protected:
    Told told(Duration now) const {
        Told all;
        ring.each(kStart + now,
                  [&](TimePoint at, double value) { all.emplace_back(at - kStart, value); });
        return all;
    }
    void put(Duration at, double value) { ring.put(kStart + at, value); }

    SlotRing ring{10s, 4};
};

TEST_F(SlotRingTest, IsEmptyAtFirst) {
    EXPECT_EQ(told(0s), Told());
    EXPECT_FALSE(ring.at(kStart));
}

TEST_F(SlotRingTest, KeepsTheLastValueOfEachSlot) {
    put(0s, 1);
    put(9s, 2);
    put(10s, 0);
    EXPECT_EQ(told(10s), (Told{{0s, 2}, {10s, 0}}));
    EXPECT_EQ(ring.at(kStart + 5s), 2);
    EXPECT_EQ(ring.at(kStart + 19s), 0);
    EXPECT_FALSE(ring.at(kStart + 20s));
    EXPECT_FALSE(ring.at(kStart - 1s));
}

TEST_F(SlotRingTest, P10AnUnsetSlotIsAbsentAndNever0) {
    put(0s, 1);
    put(30s, 4);
    EXPECT_EQ(told(30s), (Told{{0s, 1}, {30s, 4}}));
    EXPECT_FALSE(ring.at(kStart + 15s));
}

TEST_F(SlotRingTest, ForgetsTheOldest) {
    for (int i = 0; i < 6; ++i) put(i * 10s, i);
    EXPECT_EQ(told(50s), (Told{{20s, 2}, {30s, 3}, {40s, 4}, {50s, 5}}));
    put(15s, 9);
    EXPECT_EQ(told(50s).size(), 4u) << "too late";
    put(25s, 9);
    EXPECT_EQ(told(50s), (Told{{20s, 9}, {30s, 3}, {40s, 4}, {50s, 5}}));
}

TEST_F(SlotRingTest, TimeAloneMakesOld) {
    put(0s, 1);
    put(20s, 3);
    EXPECT_EQ(told(39s), (Told{{0s, 1}, {20s, 3}}));
    EXPECT_EQ(told(40s), (Told{{20s, 3}}));
    EXPECT_EQ(told(60s), Told());
    put(100s, 7);
    EXPECT_EQ(told(100s), (Told{{100s, 7}}));
}

TEST(SlotRing, KnowsNothingOfBeforeTheClockBegan) {
    SlotRing young(10s, 7);
    std::vector<double> values;
    young.put(TimePoint{15s}, 1);
    young.put(TimePoint{25s}, 2);
    young.each(TimePoint{25s}, [&](TimePoint, double value) { values.push_back(value); });
    EXPECT_EQ(values, (std::vector<double>{1, 2}));
}

TEST(SlotWidth, IsTheNarrowestThatStaysBelowTheLimit) {
    constexpr std::size_t kHour = 3600 * SlotRing::kBytes;
    EXPECT_EQ(slot_width(1, 1h, 1s, kHour), 1s);
    EXPECT_EQ(slot_width(2, 1h, 1s, kHour), 2s);
    EXPECT_EQ(slot_width(3, 1h, 1s, kHour), 5s);
    EXPECT_EQ(slot_width(1, 1h, 5s, kHour), 5s);
    EXPECT_EQ(slot_width(0, 1h, 1s, 0), 1s);
    EXPECT_EQ(slot_width(1'000'000, 1h, 1s, kHour), 600s);
}

}  // namespace
}  // namespace panelgate::slot_ring_test
