#include "panelgate/points/station_points.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "panelgate/points/station_polls.hpp"

namespace panelgate::points::station_history_test {
namespace {

constexpr TimePoint kStart{7200s};

/// temperature (a number, every second), running (a bit), name (a text).
class StationHistoryTest : public testing::Test {
  protected:
    StationHistoryTest() {
        points[0].type = Type::i16;
        points[0].every = 1s;
        points[1].type = Type::boolean;
        points[2].type = Type::string;
    }
    void good(std::size_t index, Value value, Duration at, Duration age = {}) {
        PointReading reading;
        reading.value = std::move(value);
        reading.quality = Quality::good;
        reading.age = age;
        history.record(kStart + at, points[index], reading);
    }
    void without(Quality quality, Duration at) {
        PointReading reading;
        reading.quality = quality;
        if (quality == Quality::stale) reading.value = Value(std::int64_t{99});
        history.record(kStart + at, points[0], reading);
    }
    /// "0:21.5 1:- " at `now`: seconds since kStart, values.
    std::string samples_text(std::size_t index, Duration now) const {
        std::string text;
        for (const HistorySample& sample : history.samples(points[index], kStart + now)) {
            text += std::to_string((sample.at - kStart) / 1s) + ':' +
                    (sample.value ? to_string(Value(*sample.value)) : "-") + ' ';
        }
        return text;
    }

    std::vector<Point> points = std::vector<Point>(3);
    StationHistory history{points, 1s};
};

TEST_F(StationHistoryTest, KeepsOneValueASlotAtTheTimeItWasRead) {
    good(0, Value(21.5), 0s);
    good(0, Value(std::int64_t{22}), 1900ms, 200ms);
    good(0, Value(std::int64_t{23}), 2100ms, 200ms);
    EXPECT_EQ(samples_text(0, 3s), "0:21.5 1:23 ");
    EXPECT_EQ(samples_text(1, 3s), "");
}

TEST_F(StationHistoryTest, P10ABadValueIsAGapAndAStaleOneNothingNew) {
    good(0, Value(std::int64_t{0}), 0s);
    without(Quality::stale, 1s);
    without(Quality::bad, 2s);
    without(Quality::bad, 3s);
    good(0, Value(std::int64_t{4}), 4s);
    EXPECT_EQ(samples_text(0, 5s), "0:0 2:- 4:4 ");
}

TEST_F(StationHistoryTest, ASilenceThatMakesBadIsAGap) {
    good(0, Value(std::int64_t{1}), 0s);
    good(0, Value(std::int64_t{2}), 10s);
    EXPECT_EQ(samples_text(0, 10s), "0:1 10:2 ") << "as old as a stale value may be";
    good(0, Value(std::int64_t{3}), 30s);
    EXPECT_EQ(samples_text(0, 30s), "0:1 10:2 11:- 30:3 ");
    EXPECT_EQ(samples_text(0, 41s), "0:1 10:2 11:- 30:3 31:- ") << "and it goes on";
}

TEST_F(StationHistoryTest, BitsAre0And1AndTextsAreNotKept) {
    good(1, Value(true), 0s);
    good(1, Value(false), 1s);
    good(2, Value(std::string("abc")), 0s);
    EXPECT_EQ(samples_text(1, 1s), "0:1 1:0 ");
    EXPECT_EQ(samples_text(2, 1s), "");
    EXPECT_FALSE(StationHistory::keeps(points[2]));
}

TEST_F(StationHistoryTest, ForgetsWhatIsOlderThanAnHour) {
    for (int i = 0; i < 4000; ++i) good(0, Value(std::int64_t{i}), i * 1s);
    const auto samples = history.samples(points[0], kStart + 3999s);
    ASSERT_EQ(samples.size(), 3600u);
    EXPECT_EQ(samples.front().value, 400);
    EXPECT_EQ(samples.back().value, 3999);
}

TEST(StationHistoryWidth, GrowsWithTheNumberOfPointsAndBoundsTheirMemory) {
    EXPECT_EQ(StationHistory::width_for(582), 1s);
    EXPECT_EQ(StationHistory::width_for(583), 2s);
    EXPECT_EQ(StationHistory::width_for(2912), 5s);
    for (const std::size_t points : {1u, 1000u, 50'000u, 300'000u}) {
        const Duration width = StationHistory::width_for(points);
        EXPECT_LE(points * slots_of(StationHistory::kSpan, width) * SlotRing::kBytes,
                  StationHistory::kBytes)
            << points;
    }
}

TEST_F(StationHistoryTest, ThePastOfPointsThatAreTheSameGoesOn) {
    for (std::size_t i = 0; i < points.size(); ++i) points[i].name = "p" + std::to_string(i);
    good(0, std::int64_t{5}, 1s);
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

}  // namespace
}  // namespace panelgate::points::station_history_test
