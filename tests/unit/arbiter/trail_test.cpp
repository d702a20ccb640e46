#include "panelgate/arbiter/reply_times.hpp"

#include <gtest/gtest.h>

namespace panelgate::arbiter::trail_test {
namespace {

class TrailTest : public testing::Test {
  protected:
    /// A reply, followed by unsolicited bytes.
    void reply_with(Duration delay) {
        reply();
        trail_.on_unsolicited(now_ + delay);
    }
    void reply() {
        now_ += 1s;
        trail_.on_reply(now_);
    }

    Trail trail_;
    TimePoint now_{1h};
};

TEST_F(TrailTest, NothingIsExpectedOfAStationThatSendsOnlyReplies) {
    for (int i = 0; i < 20; ++i) reply();
    EXPECT_EQ(trail_.settle_time(), Duration(0));
    EXPECT_LE(trail_.until(), now_);
}

TEST_F(TrailTest, WhatIsRareIsAnAccident) {
    for (int i = 1; i < Trail::kOften; ++i) reply_with(5ms);
    reply();
    EXPECT_EQ(trail_.settle_time(), Duration(0));
}

TEST_F(TrailTest, WhatComesOftenIsWaitedForSomewhatLongerThanItHasEverLasted) {
    for (int i = 0; i < Trail::kOften; ++i) reply_with((4 + i) * 1ms);
    reply();
    const Duration longest = (3 + Trail::kOften) * 1ms;
    EXPECT_GT(trail_.settle_time(), longest);
    EXPECT_LT(trail_.settle_time(), 2 * longest);
    EXPECT_EQ(trail_.until(), now_ + trail_.settle_time());
}

TEST_F(TrailTest, NothingWaitsForWhatHasComeAlready) {
    for (int i = 0; i <= Trail::kOften; ++i) reply_with(5ms);
    EXPECT_TRUE(trail_.seen());
    EXPECT_LE(trail_.until(), now_);
    reply();
    EXPECT_FALSE(trail_.seen());
    EXPECT_GT(trail_.until(), now_);
}

TEST_F(TrailTest, SeveralPiecesBehindOneReplyAreOneTrailUpToTheLast) {
    for (int i = 0; i < Trail::kOften; ++i) {
        reply_with(2ms);
        trail_.on_unsolicited(now_ + 8ms);
        trail_.on_unsolicited(now_ + 4ms);
    }
    reply();
    EXPECT_GT(trail_.settle_time(), Duration(8ms));
}

TEST_F(TrailTest, WhatComesLongAfterTheReplyIsSomethingElse) {
    for (int i = 0; i < 20; ++i) reply_with(Trail::kLongest + 1ns);
    reply();
    EXPECT_FALSE(trail_.seen());
    EXPECT_EQ(trail_.settle_time(), Duration(0));
}

TEST_F(TrailTest, IsUnlearnedAsSoonAsItStops) {
    for (int i = 0; i < 20; ++i) reply_with(5ms);
    for (unsigned i = 0; i < Trail::kReplies; ++i) reply();
    EXPECT_EQ(trail_.settle_time(), Duration(0));
}

}  // namespace
}  // namespace panelgate::arbiter::trail_test
