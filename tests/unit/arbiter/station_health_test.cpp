#include "panelgate/arbiter/station_health.hpp"

#include <gtest/gtest.h>

#include "panelgate/base/words.hpp"

namespace panelgate::arbiter::station_health_test {
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

TEST_F(StationHealthTest, IsUnknownBeforeTheFirstTry) {
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

TEST_F(StationHealthTest, OneThatIsNotAwaitedAgainGoesAtTheFirstSilence) {
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

TEST(StationHealth, P10ALateReplyIsASignOfLifeAndNoSuccess) {
    StationHealth health(OfflineSettings{.after = 2});
    const TimePoint now{1h};
    health.on_silence(now);
    health.on_silence(now);
    ASSERT_EQ(health.state(), Health::offline);
    EXPECT_TRUE(health.on_late_reply(now + 1s)) << "it is back";
    EXPECT_EQ(health.state(), Health::suspect);
    EXPECT_FALSE(health.last_success());
    EXPECT_EQ(health.last_heard(), now + 1s);
    health.on_reply(now + 2s);
    EXPECT_EQ(health.state(), Health::online);
    EXPECT_EQ(health.last_success(), now + 2s);
}

TEST(StationHealth, P10OnALineThatIsDownNothingIsKnownUntilItIsAskedAgain) {
    StationHealth health(OfflineSettings{.after = 2});
    const TimePoint now{1h};
    health.on_reply(now);
    health.on_line_down();
    EXPECT_EQ(health.state(), Health::unknown);
    EXPECT_EQ(health.last_success(), now);
    health.on_reply(now + 1s);
    EXPECT_EQ(health.state(), Health::online);
    health.on_silence(now);
    health.on_silence(now);
    health.on_line_down();
    EXPECT_EQ(health.state(), Health::unknown);
    EXPECT_TRUE(health.offline()) << "it is asked by probes all the same";
    health.on_silence(now + 2s);
    EXPECT_EQ(health.state(), Health::offline);
}

TEST(StationHealth, P4SilentWritesAloneTakeNoStationOfflineThatAnswersReads) {
    StationHealth health(OfflineSettings{.after = 3});
    const TimePoint now{1h};
    health.on_reply(now);
    EXPECT_FALSE(health.on_silent_write());
    EXPECT_FALSE(health.on_silent_write());
    for (int i = 0; i < 9; ++i) EXPECT_TRUE(health.on_silent_write()) << "a read is to tell";
    EXPECT_EQ(health.state(), Health::suspect);
    EXPECT_TRUE(health.on_silence(now)) << "the read was silent, too";
    EXPECT_EQ(health.state(), Health::offline);
}

}  // namespace
}  // namespace panelgate::arbiter::station_health_test
