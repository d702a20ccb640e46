#include "panelgate/arbiter/book/judge.hpp"

#include <gtest/gtest.h>

#include <iterator>

namespace panelgate::arbiter::judge_test {
namespace {

constexpr Facts kAnswer = fact::answers;

TEST(Judge, EachRowDecidesWhatIsTrueOfItAlone) {
    for (const JudgeRow& row : kJudgeRows) EXPECT_EQ(judge(row.all), row.done) << row.all;
    EXPECT_EQ(std::prev(std::end(kJudgeRows))->all, 0u) << "the last one fits everything";
}

TEST(Judge, P1WhatMayBeAnotherMastersIsNothingElse) {
    EXPECT_EQ(judge(kAnswer | fact::other_master | fact::repeats), Done::contested);
    EXPECT_EQ(judge(fact::known | fact::other_master | fact::outstanding), Done::nobodys);
}

TEST(Judge, P1ARefusalOfAnotherRequestIsNotHeldForADuplicate) {
    EXPECT_EQ(judge(kAnswer | fact::refuses_other | fact::repeats | fact::may_ask), Done::reject);
}

TEST(Judge, P1OnlyWhatCanBeAskedOnceMoreIs) {
    EXPECT_EQ(judge(kAnswer | fact::repeats), Done::keep);
    EXPECT_EQ(judge(kAnswer | fact::repeats | fact::may_ask), Done::ask_again);
    EXPECT_EQ(judge(kAnswer | fact::may_ask), Done::accept);
}

TEST(Judge, P1OnceAStationSendsDuplicatesTheOutstandingReplyStillComes) {
    EXPECT_EQ(judge(fact::known | fact::repeats | fact::outstanding), Done::late);
    EXPECT_EQ(judge(fact::known | fact::repeats | fact::outstanding | fact::sends_twice),
              Done::duplicate);
    EXPECT_EQ(judge(fact::known | fact::outstanding | fact::sends_twice), Done::late);
}

TEST(Judge, P8AReplyToABroadcastIsOneOnlyIfItIsNothingElse) {
    EXPECT_EQ(judge(fact::known | fact::broadcast | fact::outstanding), Done::late);
    EXPECT_EQ(judge(fact::known | fact::broadcast), Done::broadcast);
    EXPECT_EQ(judge(fact::broadcast), Done::broadcast) << "also of an unknown station";
    EXPECT_EQ(judge(fact::known | fact::broadcast | fact::last_form), Done::broadcast)
        << "its fields say more than its length";
    constexpr Facts kMayRepeat = fact::known | fact::broadcast | fact::repeats;
    EXPECT_EQ(judge(kMayRepeat), Done::duplicate);
    EXPECT_EQ(judge(kMayRepeat | fact::answers_all), Done::broadcast);
}

TEST(Judge, P8AStationThatAnswersThemIsBelievedToDoSoAgain) {
    EXPECT_EQ(judge(fact::known | fact::broadcast | fact::answers_all | fact::outstanding),
              Done::broadcast);
}

TEST(Judge, P3WhatFitsNothingEndsTheAttemptOfItsStation) {
    EXPECT_EQ(judge(fact::known), Done::unasked);
    EXPECT_EQ(judge(0), Done::nobodys);
}

}  // namespace
}  // namespace panelgate::arbiter::judge_test
