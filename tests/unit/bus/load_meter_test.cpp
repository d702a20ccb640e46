#include "panelgate/bus/load_meter.hpp"

#include <gtest/gtest.h>

namespace panelgate::bus {
namespace {

constexpr TimePoint kStart{1h};

class LoadMeterTest : public ::testing::Test {
  protected:
    /// A second of which the line is busy for this long; per cent at its end.
    double second(Duration busy_for) {
        now += 1s;
        busy += busy_for;
        return meter.update(now, busy);
    }

    LoadMeter meter;
    TimePoint now = kStart;
    Duration busy{};
};

TEST_F(LoadMeterTest, ALineThatWasNeverBusyHasNoLoad) {
    for (int i = 0; i < 20; ++i) EXPECT_EQ(second(0s), 0);
}

TEST_F(LoadMeterTest, AnEvenLoadIsItsShare) {
    double load = 0;
    for (int i = 0; i < 20; ++i) load = second(250ms);
    EXPECT_NEAR(load, 25, 1e-9);
}

TEST_F(LoadMeterTest, FollowsAChangeWithinSeconds) {
    for (int i = 0; i < 60; ++i) second(900ms);
    double load = 0;
    for (int i = 0; i < 12; ++i) load = second(100ms);
    EXPECT_NEAR(load, 10, 1e-9);
    for (int i = 0; i < 12; ++i) load = second(1s);
    EXPECT_NEAR(load, 100, 1e-9);
}

TEST_F(LoadMeterTest, AShortPeakIsSpreadOverSecondsAndForgotten) {
    for (int i = 0; i < 12; ++i) second(0s);
    const double peak = second(1s);
    EXPECT_GT(peak, 0);
    EXPECT_LE(peak, 20) << "one of five seconds at least";
    double load = peak;
    for (int i = 0; i < 12; ++i) load = second(0s);
    EXPECT_EQ(load, 0);
}

TEST_F(LoadMeterTest, IsNeverAboveAllOfIt) {
    for (int i = 0; i < 12; ++i) EXPECT_LE(second(2s), 100) << "counted at the start of a frame";
}

TEST_F(LoadMeterTest, AskingTwiceAtOneInstantIsHarmless) {
    for (int i = 0; i < 12; ++i) second(500ms);
    EXPECT_EQ(meter.update(now, busy), meter.update(now, busy));
    EXPECT_EQ(LoadMeter().update(TimePoint{}, 1s), 0) << "no time has passed";
}

TEST_F(LoadMeterTest, WhoLooksSeldomSeesTheTimeSinceTheLastLook) {
    for (int i = 0; i < 3; ++i) second(0s);
    now += 1min;
    busy += 30s;
    meter.update(now, busy);
    now += 1min;
    busy += 15s;
    EXPECT_NEAR(meter.update(now, busy), 25, 1e-9);
}

}  // namespace
}  // namespace panelgate::bus
