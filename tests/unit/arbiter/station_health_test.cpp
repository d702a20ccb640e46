#include "panelgate/arbiter/station_health.hpp"

#include <gtest/gtest.h>

#include "panelgate/base/health.hpp"

namespace panelgate::arbiter {
namespace {

class StationHealthTest : public testing::Test {
  protected:
    bool miss() { return health.on_silence(now += 1s); }
    void go_offline() {
        while (!health.offline()) miss();
    }
    Duration until_probe() const { return health.next_probe() - now; }

    StationHealth health{{.after = 3, .probe_min = 500ms, .probe_max = 3s}};
    TimePoint now{1h};
};

TEST_F(StationHealthTest, NobodyKnowsItBeforeTheFirstTry) {
    EXPECT_EQ(health.state(), Health::unknown);
    EXPECT_FALSE(health.last_success());
}

TEST_F(StationHealthTest, P4SoManySilencesInARowTakeItOfflineOnce) {
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

TEST_F(StationHealthTest, EachReturnFromASilenceMayHaveBeenARestart) {
    health.on_reply(now);
    EXPECT_EQ(health.returns(), 0u);
    miss();
    health.on_reply(now);
    health.on_reply(now);
    EXPECT_EQ(health.returns(), 1u);
    miss();
    health.on_damaged();
    EXPECT_EQ(health.returns(), 2u) << "damaged, but heard";
    go_offline();
    health.on_reply(now);
    EXPECT_EQ(health.returns(), 3u);
}

TEST_F(StationHealthTest, OneThatNobodyWaitsForAgainGoesAtTheFirstSilence) {
    EXPECT_TRUE(health.on_silence(now, true));
    EXPECT_TRUE(health.offline());
}

TEST_F(StationHealthTest, AReplyBringsItBackAndIsRemembered) {
    go_offline();
    EXPECT_TRUE(health.on_reply(now));
    EXPECT_EQ(health.state(), Health::online);
    EXPECT_EQ(health.last_success(), now);
    EXPECT_FALSE(health.on_reply(now + 1s)) << "back already";
    EXPECT_EQ(health.last_success(), now + 1s);
    miss();
    EXPECT_EQ(health.state(), Health::suspect);
    EXPECT_EQ(health.last_success(), now);
}

TEST_F(StationHealthTest, P4ThePauseBetweenProbesDoublesUpToItsMost) {
    go_offline();
    for (const Duration pause : {500ms, 1000ms, 2000ms, 3000ms, 3000ms}) {
        EXPECT_EQ(until_probe(), pause);
        miss();
    }
    health.on_reply(now);
    go_offline();
    EXPECT_EQ(until_probe(), Duration(500ms)) << "from the start again";
}

TEST_F(StationHealthTest, P4AWriteMayBeTheProbeOnceAnInterval) {
    go_offline();
    EXPECT_FALSE(health.take_half_open(now)) << "it has only just been silent";
    EXPECT_TRUE(health.take_half_open(now + 500ms));
    EXPECT_FALSE(health.take_half_open(now + 500ms));
    EXPECT_FALSE(health.take_half_open(now + 999ms));
    EXPECT_TRUE(health.take_half_open(now + 1s));
}

}  // namespace
}  // namespace panelgate::arbiter
