#include "panelgate/bus/line_history.hpp"

#include <gtest/gtest.h>

namespace panelgate::bus::load_meter_test {
namespace {

constexpr TimePoint kStart{1h};

class LoadMeterTest : public ::testing::Test {
  protected:
    /// Records a second that was busy for this long at its end, and returns the load in per cent.
    double second(Duration busy_for) {
        now += 1s;
        busy += busy_for;
        meter.record(now, busy);
        return meter.percent(now);
    }

    LoadMeter meter{kStart};
    TimePoint now = kStart;
    Duration busy{};
};

TEST_F(LoadMeterTest, ALineThatWasNeverBusyHasNoLoad) {
    EXPECT_EQ(meter.percent(kStart), 0) << "no time has passed";
    for (int i = 0; i < 20; ++i) EXPECT_EQ(second(0s), 0);
}

TEST_F(LoadMeterTest, AnEvenLoadIsItsShareFromTheFirstSecondOn) {
    for (int i = 0; i < 20; ++i) EXPECT_NEAR(second(250ms), 25, 1e-9) << i;
}

TEST_F(LoadMeterTest, TheFirstSecondIsMeasuredToo) {
    meter.record(kStart + 400ms, 100ms);
    EXPECT_NEAR(meter.percent(kStart + 500ms), 20, 1e-9);
}

TEST_F(LoadMeterTest, FollowsAChangeInTenSeconds) {
    for (int i = 0; i < 60; ++i) second(900ms);
    double load = 0;
    for (int i = 0; i < 10; ++i) load = second(100ms);
    EXPECT_NEAR(load, 10, 1e-9);
    for (int i = 0; i < 10; ++i) load = second(1s);
    EXPECT_NEAR(load, 100, 1e-9);
}

TEST_F(LoadMeterTest, AShortPeakCountsForTenSecondsAndIsForgotten) {
    for (int i = 0; i < 12; ++i) second(0s);
    EXPECT_NEAR(second(1s), 10, 1e-9);
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(second(0s), 10, 1e-9) << i;
    EXPECT_EQ(second(0s), 0);
}

TEST_F(LoadMeterTest, WhoAsksOftenAndWhoAsksSeldomAreToldTheSame) {
    LoadMeter lonely(kStart);
    for (int i = 0; i < 100; ++i) {
        now += 137ms;
        busy += i < 60 ? 90ms : 3ms;
        meter.record(now, busy);
        lonely.record(now, busy);
        for (int k = 0; k < 3; ++k) static_cast<void>(meter.percent(now));
    }
    EXPECT_EQ(meter.percent(now), lonely.percent(now));
    EXPECT_GT(meter.percent(now), 0);
    EXPECT_EQ(lonely.percent(now + 25s), 0) << "an idle line";
}

TEST_F(LoadMeterTest, ATransactionOfSeveralSecondsIsSpreadOverThem) {
    now += 20s;
    meter.record(now + 500ms, 4s);
    EXPECT_NEAR(meter.percent(now), 35, 1e-9) << "half a second of it is not over yet";
    EXPECT_NEAR(meter.percent(now + 1s), 40, 1e-9);
    EXPECT_NEAR(meter.percent(now + 9s), 15, 1e-9)
        << "the half second before, and the one that was not over";
}

TEST_F(LoadMeterTest, IsNeverAboveAllOfIt) {
    for (int i = 0; i < 12; ++i) EXPECT_LE(second(2s), 100) << "the gap behind a frame counts too";
}

}  // namespace
}  // namespace panelgate::bus::load_meter_test
