#include "panelgate/arbiter/attempt/answers.hpp"

#include <gtest/gtest.h>

#include "support/attempts.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::answers_test {
namespace {

using Kept = Answers::Kept;

const Bytes kOne = "03 02 00 01"_hex;
const Bytes kTwo = "03 02 00 02"_hex;
const Answers::Times kFirst{TimePoint{1s}, TimePoint{1010ms}};

class AnswersTest : public testing::Test {
  protected:
    std::optional<Bytes> add(const Bytes& reply, Answers::Others others = {}) {
        return answers_.add(reply, std::move(others), group_);
    }
    void keep(Kept kind) { answers_.keep(kind, kFirst); }

    Group group_ = test::group_of(1, "03 00 00 00 01"_hex);
    Answers answers_;
};

TEST_F(AnswersTest, TheLastAnswerIsTheReply) {
    EXPECT_FALSE(add(kOne));
    EXPECT_EQ(answers_.reply(), kOne);
    EXPECT_FALSE(answers_.in_time());
    EXPECT_FALSE(answers_.contradicted());
}

TEST_F(AnswersTest, ACandidateIsTheReplyIfNothingElseComes) {
    add(kOne);
    keep(Kept::believed);
    EXPECT_FALSE(answers_.has_reply());
    answers_.believe();
    EXPECT_EQ(answers_.reply(), kOne);
    EXPECT_EQ(answers_.in_time()->came, kFirst.came);
}

TEST_F(AnswersTest, ACandidateThatIsFollowedWasNone) {
    add(kOne);
    keep(Kept::doubted);
    EXPECT_EQ(add(kTwo), kOne);
    EXPECT_EQ(answers_.reply(), kTwo);
    EXPECT_FALSE(answers_.contradicted());
    EXPECT_TRUE(answers_.take_set_aside().empty());
}

TEST_F(AnswersTest, OneThatComesTwiceTellsWhenItCameFirst) {
    add(kOne);
    keep(Kept::doubted);
    EXPECT_FALSE(add(kOne));
    EXPECT_EQ(answers_.first_came(), kFirst.came);
}

TEST_F(AnswersTest, TwoThatDifferAreUndecided) {
    add(kOne);
    keep(Kept::held);
    EXPECT_FALSE(add(kTwo));
    EXPECT_TRUE(answers_.contradicted());
    EXPECT_TRUE(answers_.is_undecided(false, group_));
    EXPECT_EQ(answers_.take_set_aside(), std::vector<Bytes>{kOne});
}

TEST_F(AnswersTest, WhatAnEarlierAttemptHadTooIsTheReply) {
    group_.said.push_back(kOne);
    add(kOne);
    keep(Kept::held);
    add(kTwo);
    EXPECT_EQ(answers_.reply(), kOne);
    EXPECT_EQ(answers_.in_time()->came, kFirst.came);
    EXPECT_FALSE(answers_.is_undecided(false, group_));
    EXPECT_TRUE(answers_.is_undecided(true, group_));  // it may be another request's
    EXPECT_EQ(answers_.take_set_aside(), std::vector<Bytes>{kTwo});
}

TEST_F(AnswersTest, IfTheEarlierAttemptHadBothNothingIsDecided) {
    group_.said = {kOne, kTwo};
    add(kOne, {true, {kTwo}});
    EXPECT_EQ(answers_.reply(), kOne);
    EXPECT_TRUE(answers_.is_undecided(false, group_));
}

TEST_F(AnswersTest, OneThatHasOnlyBegunContradictsTheHeldOne) {
    add(kOne);
    keep(Kept::held);
    EXPECT_TRUE(answers_.holds());
    answers_.on_other_begun();
    EXPECT_FALSE(answers_.holds());
    EXPECT_TRUE(answers_.is_doubted());
    EXPECT_TRUE(answers_.contradicted());
}

TEST_F(AnswersTest, WhatComesBehindABelievedOneThatWasRejectedHasItsOwnTime) {
    add(kOne);
    keep(Kept::believed);
    answers_.believe();
    EXPECT_EQ(answers_.reject(), kOne);
    add(kTwo);
    EXPECT_FALSE(answers_.in_time());
}

TEST_F(AnswersTest, TheGroupRemembersTheDoubt) {
    add(kOne);
    keep(Kept::held);
    add(kTwo);
    keep(Kept::doubted);
    answers_.mark_early();
    answers_.remember_in(group_);
    EXPECT_EQ(group_.doubted, kTwo);
    EXPECT_EQ(group_.doubted_at, kFirst.came);
    EXPECT_TRUE(group_.doubted_as_early);
    EXPECT_EQ(group_.doubts, 1);
    EXPECT_TRUE(group_.was_said(kOne));
    EXPECT_TRUE(group_.was_said(kTwo));
}

TEST_F(AnswersTest, AnEarlyOneIsOneWhileItIsAllThatCame) {
    add(kOne);
    keep(Kept::doubted);
    answers_.mark_early();
    EXPECT_TRUE(answers_.is_early());
    EXPECT_FALSE(answers_.follows_early());
    add(kTwo);
    EXPECT_FALSE(answers_.is_early());
    EXPECT_TRUE(answers_.follows_early());
    keep(Kept::doubted);
    answers_.remember_in(group_);
    EXPECT_FALSE(group_.doubted_as_early);
}

TEST_F(AnswersTest, NoMoreThanSomeAreRemembered) {
    Answers::Others others{.any = true};
    for (std::uint8_t i = 0; i < 2 * Answers::kMostSaid; ++i)
        others.whole.push_back({0x03, 0x02, 0x01, i});
    add(kOne, std::move(others));
    keep(Kept::doubted);
    answers_.remember_in(group_);
    EXPECT_EQ(group_.said.size(), Answers::kMostSaid);
}

}  // namespace
}  // namespace panelgate::arbiter::answers_test
