#include "panelgate/arbiter/reply_times.hpp"

#include <gtest/gtest.h>

namespace panelgate::arbiter::turnaround_test {
namespace {

TEST(Turnaround, KnowsTheQuantilesOfTheLastReplies) {
    Turnaround seen;
    EXPECT_FALSE(seen.known());
    for (int i = 1; i <= 200; ++i) seen.add(i * 1ms);
    EXPECT_TRUE(seen.known());
    EXPECT_EQ(seen.quantile(1), Duration(200ms));
    EXPECT_EQ(seen.quantile(0.5), Duration(169ms));
}

TEST(Turnaround, ReachesWhatItsQuantilesAreAtLeast) {
    Turnaround seen;
    for (int i = 1; i <= 90; ++i) {
        seen.add((i * 37 % 50) * 1ms);
        for (const double share : {0.1, 0.5, 0.95, 1.0}) {
            for (int bound = 0; bound <= 51; ++bound)
                EXPECT_EQ(seen.reaches(share, bound * 1ms), seen.quantile(share) >= bound * 1ms);
        }
    }
}

TEST(AdaptiveTimeout, FollowsTheTurnaroundBetweenFloorAndCeiling) {
    AdaptiveTimeout timeout(20ms, 500ms);
    Turnaround seen;
    EXPECT_EQ(timeout.value(seen), Duration(500ms)) << "nothing is known yet";
    for (int i = 0; i < 10; ++i) seen.add(5ms);
    EXPECT_EQ(timeout.value(seen), Duration(30ms));
    timeout.on_timeout();
    EXPECT_EQ(timeout.value(seen), Duration(60ms));
    for (int i = 0; i < 100; ++i) timeout.on_timeout();
    EXPECT_EQ(timeout.value(seen), Duration(500ms));
    timeout.on_reply();
    EXPECT_EQ(timeout.value(seen), Duration(30ms));
}

TEST(DriftAlarm, ReportsOnceUntilTheStationHasRecovered) {
    DriftAlarm alarm;
    Turnaround seen;
    int told = 0;
    const auto replies = [&](int count, Duration think) {
        for (int i = 0; i < count; ++i) {
            seen.add(think);
            told += alarm.check(seen, 100ms) ? 1 : 0;
        }
    };
    replies(100, 10ms);
    EXPECT_EQ(told, 0);
    replies(100, 85ms);
    EXPECT_EQ(told, 1);
    replies(100, 10ms);
    replies(100, 85ms);
    EXPECT_EQ(told, 2);
}

}  // namespace
}  // namespace panelgate::arbiter::turnaround_test
