#include "panelgate/arbiter/station_health.hpp"

#include <gtest/gtest.h>

#include "panelgate/base/words.hpp"

namespace panelgate::arbiter::station_health_test {
namespace {

constexpr TimePoint kStart{1h};

class StationHealthTest : public testing::Test {
  protected:
    bool miss() { return health.on_silence(now += 1s); }
    void go_offline() {
        while (!health.offline()) miss();
    }

    StationHealth health{{.after = 3, .probe_min = 500ms, .probe_max = 3s}};
    TimePoint now = kStart;
};

TEST_F(StationHealthTest, P4SoManySilencesInARowTakeItOfflineOnce) {
    EXPECT_EQ(health.state(), Health::unknown);
    EXPECT_FALSE(health.last_success());
    EXPECT_FALSE(miss());
    EXPECT_EQ(health.state(), Health::suspect);
    EXPECT_FALSE(miss());
    EXPECT_TRUE(miss()) << "told once";
    EXPECT_TRUE(health.offline());
    EXPECT_FALSE(miss());
    EXPECT_EQ(health.silent_in_a_row(), 4);
}

TEST_F(StationHealthTest, P4AnythingHeardStartsTheCountAnew) {
    miss();
    miss();
    EXPECT_FALSE(health.on_reply(now)) << "it was not away";
    miss();
    miss();
    health.on_damaged();
    EXPECT_EQ(health.state(), Health::suspect);
    miss();
    miss();
    EXPECT_FALSE(health.offline());
    EXPECT_TRUE(miss());
}

TEST_F(StationHealthTest, P4ThePauseBetweenProbesDoublesUpToItsMost) {
    go_offline();
    for (const Duration pause : {500ms, 1000ms, 2000ms, 3000ms, 3000ms}) {
        EXPECT_EQ(health.next_probe() - now, pause);
        miss();
    }
    health.on_reply(now);
    go_offline();
    EXPECT_EQ(health.next_probe() - now, Duration(500ms)) << "from the start again";
}

TEST_F(StationHealthTest, P4AWriteMayBeTheProbeOnceAnInterval) {
    go_offline();
    EXPECT_FALSE(health.take_half_open(now)) << "it has only just been silent";
    EXPECT_TRUE(health.take_half_open(now + 500ms));
    EXPECT_FALSE(health.take_half_open(now + 500ms));
    EXPECT_FALSE(health.take_half_open(now + 999ms));
    EXPECT_TRUE(health.take_half_open(now + 1s));
}

TEST_F(StationHealthTest, P10ALateReplyIsASignOfLifeAndNoSuccess) {
    go_offline();
    EXPECT_TRUE(health.on_late_reply(now + 1s)) << "it is back";
    EXPECT_EQ(health.state(), Health::suspect);
    EXPECT_FALSE(health.last_success());
    EXPECT_EQ(health.last_heard(), now + 1s);
    health.on_reply(now + 2s);
    EXPECT_EQ(health.state(), Health::online);
    EXPECT_EQ(health.last_success(), now + 2s);
}

TEST_F(StationHealthTest, P10OnALineThatIsDownNothingIsKnownUntilItIsAskedAgain) {
    health.on_reply(now);
    health.on_line_down();
    EXPECT_EQ(health.state(), Health::unknown);
    EXPECT_EQ(health.last_success(), now);
    health.on_reply(now + 1s);
    EXPECT_EQ(health.state(), Health::online);
    go_offline();
    health.on_line_down();
    EXPECT_EQ(health.state(), Health::unknown);
    EXPECT_TRUE(health.offline()) << "it is asked by probes all the same";
    miss();
    EXPECT_EQ(health.state(), Health::offline);
}

TEST_F(StationHealthTest, P4SilentWritesAloneTakeNoStationOfflineThatAnswersReads) {
    health.on_reply(now);
    EXPECT_FALSE(health.on_silent_write());
    EXPECT_FALSE(health.on_silent_write());
    for (int i = 0; i < 9; ++i) EXPECT_TRUE(health.on_silent_write()) << "a read is to tell";
    EXPECT_EQ(health.state(), Health::suspect);
    EXPECT_TRUE(miss()) << "the read was silent, too";
    EXPECT_EQ(health.state(), Health::offline);
}

TEST(ProbeBudget, P4SpendingWheneverAllowedStaysAtTheShare) {
    for (const double share : {ProbeBudget::kOffline, ProbeBudget::kSuspect}) {
        ProbeBudget budget(share);
        TimePoint now = kStart;
        Duration spent{};
        for (int i = 0; i < 200; ++i) {
            const Duration cost = (1 + i * 37 % 500) * 1ms;
            ASSERT_TRUE(budget.allows(now));
            now += cost;
            spent += cost;
            budget.spend(now, cost);
            now = budget.next();
            ASSERT_FALSE(budget.allows(now - 1ns));
        }
        EXPECT_NEAR(to_seconds(spent) / to_seconds(now - kStart), share, share / 1000);
        budget.clear();
        EXPECT_TRUE(budget.allows(kStart)) << "free again";
    }
}

TEST(ProbeBudget, P4AnExcessIsPaidOffUpToALimit) {
    ProbeBudget budget(0.2);
    for (int i = 1; i <= 3; ++i) budget.spend(kStart + i * 100ms, 100ms, 1h);
    EXPECT_EQ(budget.next(), kStart + 1500ms) << "a fifth of that time was spent";
    EXPECT_FALSE(budget.allows(kStart + 500ms));
    for (int i = 4; i <= 100; ++i) budget.spend(kStart + i * 100ms, 100ms, 2s);
    EXPECT_EQ(budget.next(), kStart + 10s + 2s);
    budget.spend(kStart + 11s, 1s, 2s);
    EXPECT_EQ(budget.next(), kStart + 15s) << "one that is dearer is paid in full";
}

}  // namespace
}  // namespace panelgate::arbiter::station_health_test
