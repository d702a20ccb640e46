#include "panelgate/arbiter/heard_before.hpp"

#include <gtest/gtest.h>

#include "arbiter_fixture.hpp"

namespace panelgate::arbiter::heard_before_test {
namespace {

TEST(HeardBefore, KnowsTheLastRepliesOfEachStationAndWhichIsTheNewest) {
    HeardBefore before;
    EXPECT_FALSE(before.is_old_reply(17, reply_number(1)));
    for (unsigned i = 1; i <= 9; ++i) before.on_answered(17, read_at(i), reply_number(i));
    EXPECT_FALSE(before.is_old_reply(17, reply_number(9))) << "the last one";
    EXPECT_TRUE(before.is_old_reply(17, reply_number(8)));
    EXPECT_TRUE(before.is_old_reply(17, reply_number(2)));
    EXPECT_FALSE(before.is_old_reply(17, reply_number(1))) << "forgotten";
    EXPECT_FALSE(before.is_old_reply(18, reply_number(8)));
}

TEST(HeardBefore, KnowsAReadThatWentUnansweredOnce) {
    HeardBefore before;
    before.on_unanswered(17, read_at(1));
    before.on_unanswered(17, read_at(1));
    EXPECT_FALSE(before.on_answered(18, read_at(1), kReply));
    EXPECT_FALSE(before.on_answered(17, read_at(2), kReply));
    EXPECT_TRUE(before.on_answered(17, read_at(1), kReply));
    EXPECT_FALSE(before.on_answered(17, read_at(1), kReply)) << "told";
    for (unsigned i = 1; i <= 17; ++i) before.on_unanswered(17, read_at(i));
    EXPECT_FALSE(before.on_answered(17, read_at(1), kReply)) << "forgotten";
    EXPECT_TRUE(before.on_answered(17, read_at(17), kReply));
}

}  // namespace
}  // namespace panelgate::arbiter::heard_before_test
