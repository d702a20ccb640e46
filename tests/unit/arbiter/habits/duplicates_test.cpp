#include "panelgate/arbiter/habits/duplicates.hpp"

#include <gtest/gtest.h>

#include "support/hex.hpp"

namespace panelgate::arbiter::duplicates_test {
namespace {

const TimePoint kStart{1h};
const Bytes kRead = "03 00 00 00 01"_hex;
const Bytes kOne = "03 02 00 01"_hex;
const Bytes kTwo = "03 02 00 02"_hex;
const Bytes kThree = "03 02 00 03"_hex;
const Bytes kFour = "03 02 00 04"_hex;

TEST(EqualAnswers, OneIsTrustedAfterThreeTimesAndAnyAfterThreeThatDiffer) {
    EqualAnswers seen;
    seen.add(kOne);
    seen.add(kOne);
    EXPECT_FALSE(seen.trusts(kOne));
    seen.add(kOne);
    EXPECT_TRUE(seen.trusts(kOne));
    EXPECT_FALSE(seen.trusts(kTwo));
    seen.add(kTwo);
    seen.add(kThree);
    EXPECT_TRUE(seen.trusts(kFour));
}

TEST(DuplicateHabit, RestsForHalfAsLongAgainAsItsLatestDuplicateTookUntilItIsForgotten) {
    DuplicateHabit habit;
    EXPECT_FALSE(habit.known());
    habit.on_copy(kStart + 8ms, kStart, kStart);
    EXPECT_EQ(habit.settle_time(), Duration(12ms));
    EXPECT_TRUE(habit.repeats_itself(kStart + 20ms, kStart));
    EXPECT_FALSE(habit.repeats_itself(kStart + 30ms, kStart));
    habit.on_reply(kStart + 8ms + timing::kForgetDuplicates);
    EXPECT_TRUE(habit.known());
    habit.on_reply(kStart + 9ms + timing::kForgetDuplicates);
    EXPECT_FALSE(habit.known());
}

TEST(DuplicateHabit, AGuessThatIsTooLongEndsAfterThreeThatCameInLessThanHalfOfIt) {
    DuplicateHabit habit;
    // The reply of 100 ms ago, 5 ms behind the last one: either may be what it follows.
    habit.on_copy(kStart + 100ms, kStart, kStart + 95ms);
    EXPECT_EQ(habit.settle_time(), Duration(150ms));
    habit.learn(kStart + 200ms, 5ms);
    habit.learn(kStart + 300ms, 5ms);
    EXPECT_EQ(habit.settle_time(), Duration(150ms));
    habit.learn(kStart + 400ms, 5ms);
    EXPECT_EQ(habit.settle_time(), Duration(7500us));
}

TEST(DuplicateHabit, ThreeAnswersInARowThatChangeWhenAskedAgainAreDuplicates) {
    DuplicateHabit habit;
    for (int i = 1; i <= 3; ++i) {
        EXPECT_FALSE(habit.known());
        habit.on_denied(kStart + i * 1s, kStart + i * 1s - 30ms);
    }
    EXPECT_EQ(habit.settle_time(), Duration(45ms));
}

TEST(DuplicateHabit, AnEqualAnswerIsSuspiciousUntilItHasBeenConfirmedThreeTimes) {
    DuplicateHabit habit;
    Claims claims;
    EXPECT_FALSE(habit.suspicious(kStart, kRead, kOne, claims));
    claims.repeats_other = true;
    EXPECT_TRUE(habit.suspicious(kStart, kRead, kOne, claims));
    for (int i = 0; i < DuplicateHabit::kConfirmations; ++i) habit.on_confirmed(kRead, kOne);
    EXPECT_FALSE(habit.suspicious(kStart, kRead, kOne, claims));
    EXPECT_TRUE(habit.suspicious(kStart, kRead, kTwo, claims));
}

TEST(DuplicateHabit, HoldsAnswersOfAStationThatSendsSurplusOnesUnlessAllItsRequestsHaveTwo) {
    DuplicateHabit habit;
    habit.on_surplus(kStart, 10ms);
    EXPECT_EQ(habit.hold(kStart), Duration::zero()) << "once is none";
    habit.on_surplus(kStart + 1s, 20ms);
    EXPECT_EQ(habit.hold(kStart + 1s), Duration(30ms) + timing::kReceiveMargin);
    EXPECT_EQ(habit.hold(kStart + 2s + timing::kForgetDuplicates), Duration::zero());
    for (int i = 0; i < 6; ++i) habit.on_asked_again(true);
    EXPECT_EQ(habit.hold(kStart + 1s), Duration::zero());
}

}  // namespace
}  // namespace panelgate::arbiter::duplicates_test
