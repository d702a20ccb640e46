#include "panelgate/rt/asio_clock.hpp"

#include <gtest/gtest.h>

namespace panelgate::rt::lead_time_test {
namespace {

TEST(LeadTime, FollowsWhatTwoOfThreeAreLate) {
    LeadTime lead;
    TimePoint now{};
    for (int i = 0; i < 10000; ++i) lead.on_rung(now += 10ms, i % 4 == 0 ? 2ms : 15us, 0us);
    EXPECT_GE(lead.lead(), 14us);
    EXPECT_LE(lead.lead(), 17us);
}

TEST(LeadTime, HasABound) {
    LeadTime lead;
    TimePoint now{};
    for (int i = 0; i < 10000; ++i) lead.on_rung(now += 10ms, 5ms, 0us);
    EXPECT_EQ(lead.lead(), LeadTime::kMost);
}

TEST(LeadTime, WatchesTheClockForAThirtiethOfTheTimeAtMost) {
    LeadTime lead;
    TimePoint now{};
    Duration watched{};
    for (int i = 0; i < 100000; ++i) {
        const Duration watch = lead.lead();
        lead.on_rung(now += 500us, LeadTime::kMost, watch);
        watched += watch;
    }
    EXPECT_LE(watched, 50000ms / 30 + 20ms);
    EXPECT_GE(watched, 50000ms / 40);
}

TEST(LeadTime, ALongRestSavesNoMoreThanAMoment) {
    LeadTime lead;
    TimePoint now{};
    lead.on_rung(now += 1h, 80us, 11ms);
    EXPECT_EQ(lead.lead(), 0us);
    lead.on_rung(now += 1h, 80us, 0us);
    EXPECT_GT(lead.lead(), 0us);
}

}  // namespace
}  // namespace panelgate::rt::lead_time_test
