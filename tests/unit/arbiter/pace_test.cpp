#include "panelgate/arbiter/quiet.hpp"

#include <gtest/gtest.h>

namespace panelgate::arbiter::pace_test {
namespace {

constexpr bool kEarly = true;

TEST(Pace, IsNotBelievedBeforeSomethingWasHeard) { EXPECT_FALSE(Pace().believed()); }

TEST(Pace, IsBelievedAfterSomeRepliesInTimeNotAfterOne) {
    Pace pace;
    pace.on_reply(!kEarly);
    EXPECT_FALSE(pace.believed());
    for (int i = 0; i < 10; ++i) pace.on_reply(!kEarly);
    EXPECT_TRUE(pace.believed());
}

TEST(Pace, P1OneReplyThatCameTooEarlySettlesIt) {
    for (const int before : {0, 1, 100}) {
        Pace pace;
        for (int i = 0; i < before; ++i) pace.on_reply(!kEarly);
        pace.on_reply(kEarly);
        EXPECT_FALSE(pace.believed());
        for (int i = 0; i < 1000; ++i) pace.on_reply(!kEarly);
        EXPECT_FALSE(pace.believed());
    }
}

TEST(Pace, HasteNowAndThenIsASenderThatWasHeldUp) {
    Pace pace;
    for (int i = 0; i < 50; ++i) {
        pace.on_rate(true);
        EXPECT_TRUE(pace.kept());
        for (int j = 0; j < 8; ++j) pace.on_rate(false);
    }
}

TEST(Pace, HasteAgainAndAgainIsNoPaceUntilItHasCeased) {
    Pace pace;
    for (int i = 0; i < 3; ++i) pace.on_rate(true);
    EXPECT_FALSE(pace.kept());
    for (int i = 0; i < 50; ++i) {
        for (int j = 0; j < 4; ++j) pace.on_rate(false);
        pace.on_rate(true);
        EXPECT_FALSE(pace.kept());
    }
    for (int i = 0; i < 16; ++i) pace.on_rate(false);
    EXPECT_TRUE(pace.kept());
}

TEST(Pace, IsNoPaceAtAllAfterSomeEarlyRepliesInARow) {
    Pace pace;
    pace.on_reply(kEarly);
    pace.on_reply(kEarly);
    EXPECT_FALSE(pace.unbound());
    pace.on_reply(kEarly);
    EXPECT_TRUE(pace.unbound());
    pace.on_reply(!kEarly);
    EXPECT_FALSE(pace.unbound());
}

}  // namespace
}  // namespace panelgate::arbiter::pace_test
