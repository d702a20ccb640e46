#include "panelgate/arbiter/habits/announced_replies.hpp"

#include <gtest/gtest.h>

#include "support/hex.hpp"

namespace panelgate::arbiter::announced_replies_test {
namespace {

const TimePoint kStart{1h};
const Bytes kAddress = "83 02"_hex;
const Bytes kAcknowledge = "83 05"_hex;
const Bytes kBusy = "83 06"_hex;
const Bytes kTargetFailed = "83 0B"_hex;

TEST(AnnouncedReplies, AcknowledgeAndBusyAnnounceUntilNothingHasFollowedThreeInARow) {
    AnnouncedReplies announced;
    for (int i = 0; i < AnnouncedReplies::kUnkept; ++i) {
        EXPECT_TRUE(announced.announces(kAcknowledge));
        EXPECT_TRUE(announced.announces(kBusy));
        announced.on_announced();
    }
    EXPECT_FALSE(announced.announces(kAcknowledge));
    EXPECT_FALSE(announced.announces(kBusy));
    announced.on_kept();
    EXPECT_TRUE(announced.announces(kBusy));
    EXPECT_FALSE(announced.announces("03 02 00 01"_hex)) << "a normal reply";
}

TEST(AnnouncedReplies, OthersDoForAWhileWhereAReplyHasFollowedButForThoseThatRefuseTheRequest) {
    AnnouncedReplies announced;
    EXPECT_FALSE(announced.announces(kTargetFailed));
    announced.on_followed(kStart);
    EXPECT_TRUE(announced.announces(kTargetFailed));
    EXPECT_TRUE(announced.announces("83 04"_hex));
    EXPECT_FALSE(announced.announces(kAddress));
    announced.forget(kStart + timing::kForgetHabit);
    EXPECT_TRUE(announced.announces(kTargetFailed));
    announced.forget(kStart + timing::kForgetHabit + 1s);
    EXPECT_FALSE(announced.announces(kTargetFailed));
}

}  // namespace
}  // namespace panelgate::arbiter::announced_replies_test
