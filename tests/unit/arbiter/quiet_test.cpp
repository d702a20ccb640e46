#include "panelgate/arbiter/quiet.hpp"

#include <gtest/gtest.h>

namespace panelgate::arbiter::quiet_test {
namespace {

constexpr Duration kLongest = 100ms;
constexpr Duration kPause = 4ms;
constexpr Duration kGap = 10ms;
constexpr TimePoint kStart{1h};

class QuietTest : public testing::Test {
  protected:
    QuietTest() { quiet_.on_open(kStart); }
    Quiet quiet_{kLongest, kPause};
};

TEST_F(QuietTest, TheGapFollowsTheOpeningAndTheLastBitSentOrHeard) {
    EXPECT_EQ(quiet_.free_at(kGap), kStart + kGap);
    quiet_.on_sent(kStart + 50ms, 17);
    EXPECT_EQ(quiet_.free_at(kGap), kStart + 60ms);
    EXPECT_EQ(quiet_.station(), 17);
    quiet_.on_heard(kStart + 40ms);
    EXPECT_EQ(quiet_.free_at(kGap), kStart + 60ms) << "our own frame was still leaving";
    quiet_.on_answered_early(kStart + 46ms);
    EXPECT_EQ(quiet_.free_at(kGap), kStart + 56ms) << "the reply shows that it had left";
    quiet_.on_heard(kStart + 70ms);
    EXPECT_EQ(quiet_.free_at(kGap), kStart + 80ms);
    EXPECT_EQ(quiet_.free_at(2 * kGap), kStart + 90ms);
}

TEST_F(QuietTest, ALineThatFloatsIsWaitedForNoLongerThanAFrameLasts) {
    TimePoint now = kStart + 50ms;
    const TimePoint first = now;
    for (; now < first + 10 * kLongest; now += kPause / 2) {
        quiet_.on_noise(now);
        EXPECT_LE(quiet_.free_at(kGap), first + kLongest + kGap);
    }
    EXPECT_LT(quiet_.free_at(kGap), now);
}

TEST_F(QuietTest, UnsolicitedBytesWithPausesAreFramesHoweverManyTheyAre) {
    TimePoint now = kStart + 50ms;
    for (int i = 0; i < 100; ++i) {
        now += kPause;
        quiet_.on_noise(now);
        EXPECT_EQ(quiet_.free_at(kGap), now + kGap);
    }
}

TEST_F(QuietTest, RestsForTheLongestRequestedTimeAndUntilThatIsOver) {
    quiet_.rest_until(kStart + 300ms);
    quiet_.rest_until(kStart + 200ms);
    EXPECT_EQ(quiet_.free_at(kGap), kStart + 300ms);
    quiet_.await_until(kStart + 400ms);
    EXPECT_EQ(quiet_.free_at({}), kStart + 400ms);
    quiet_.has_come();
    EXPECT_EQ(quiet_.free_at(kGap), kStart + 300ms);
}

TEST_F(QuietTest, P1AQuarantineLastsUntilItsLatestInstantUnlessItsOwnStationLiftsIt) {
    quiet_.quarantine(kStart, 17, kStart + 500ms);
    quiet_.quarantine(kStart, 17, kStart + 400ms);
    EXPECT_EQ(quiet_.quarantined_until(), kStart + 500ms);
    quiet_.quarantine(kStart, 17, kStart + 600ms);
    EXPECT_EQ(quiet_.quarantined_until(), kStart + 600ms);
    quiet_.lift(kStart, 18);
    EXPECT_EQ(quiet_.quarantined_until(), kStart + 600ms);
    quiet_.lift(kStart, 17);
    EXPECT_LE(quiet_.quarantined_until(), kStart);
}

}  // namespace
}  // namespace panelgate::arbiter::quiet_test
