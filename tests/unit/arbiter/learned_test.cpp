// The four numbers that are learned of a station.
#include "panelgate/arbiter/learned.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <optional>
#include <vector>

namespace panelgate::arbiter::learned_test {
namespace {

constexpr Duration kTimeout = 100ms;
constexpr TimePoint kStart{1h};

TEST(ThinkTimes, KnowTheQuantilesOfTheLastReplies) {
    ThinkTimes times;
    EXPECT_EQ(times.quantile(1), Duration{});
    for (std::size_t i = 1; i <= 200; ++i) {
        EXPECT_EQ(times.known(), i > ThinkTimes::kEnough) << i;
        times.add(i * 1ms);
    }
    EXPECT_EQ(times.quantile(1), Duration(200ms));
    EXPECT_EQ(times.quantile(0.5), Duration(169ms));
}

TEST(ThinkTimes, TellOnceThatTheyAreNearTheTimeoutUntilTheyHaveGoneBack) {
    ThinkTimes times;
    const auto tell = [&](Duration think) {
        int told = 0;
        for (int i = 0; i < 100; ++i) {
            times.add(think);
            told += times.take_report(kTimeout) ? 1 : 0;
        }
        return told;
    };
    EXPECT_EQ(tell(10ms), 0);
    EXPECT_EQ(tell(85ms), 1);
    EXPECT_EQ(tell(70ms), 0);
    EXPECT_EQ(tell(85ms), 0) << "70 ms are near as well";
    EXPECT_EQ(tell(10ms), 0);
    EXPECT_EQ(tell(85ms), 1);
}

void timely(LateWindow& window, int replies) {
    for (int i = 0; i < replies; ++i) window.on_timely();
}

TEST(LateWindow, P1GrowsBeyondTheLatenessSeenAtMostToEightTimeouts) {
    LateWindow window(std::nullopt, kTimeout);
    window.on_late(200ms);
    EXPECT_EQ(window.value(), Duration(300ms));
    window.on_late(1ms);
    EXPECT_EQ(window.value(), Duration(300ms)) << "less late";
    window.on_late(1h);
    EXPECT_EQ(window.value(), 8 * kTimeout);
    window.apply(std::nullopt, 10 * kTimeout);
    EXPECT_EQ(window.value(), 10 * kTimeout);
}

TEST(LateWindow, ShrinksWhileRepliesComeInTimeButNotBelowTheResponseTimeout) {
    LateWindow window(std::nullopt, kTimeout);
    window.on_late(200ms);
    timely(window, LateWindow::kForget - 1);
    window.on_late(1ms);  // the count of timely replies begins anew
    timely(window, LateWindow::kForget - 1);
    EXPECT_EQ(window.value(), Duration(300ms));
    timely(window, 1);
    EXPECT_EQ(window.value(), Duration(200ms));
    timely(window, 10 * LateWindow::kForget);
    EXPECT_EQ(window.value(), kTimeout);
}

TEST(LateWindow, LatenessIsRegularFromTheSecondLateReplyOnAndForgottenAfterManyInTime) {
    LateWindow window(std::nullopt, kTimeout);
    window.on_late(300ms);
    EXPECT_EQ(window.worst(), Duration(0));
    window.on_late(50ms);
    EXPECT_EQ(window.worst(), Duration(300ms));
    timely(window, LateWindow::kForget);
    EXPECT_EQ(window.worst(), Duration(0));
    window.on_late(20ms);
    window.on_late(10ms);
    EXPECT_EQ(window.worst(), Duration(20ms)) << "the old lateness is forgotten, too";
}

TEST(ReplyHole, IsLearnedFromTwoBrokenRepliesInARowAndForgottenWithoutPauses) {  // T4
    ReplyHole hole;
    TimePoint now = kStart;
    hole.on_broken(now, 80ms, 500ms);
    EXPECT_EQ(hole.learned(), 0ms) << "one broken reply may be noise";
    hole.on_reply(now, 1ms);
    hole.on_broken(now, 80ms, 500ms);
    EXPECT_EQ(hole.learned(), 0ms) << "not in a row";
    hole.on_broken(now, 60ms, 500ms);
    EXPECT_EQ(hole.learned(), 110ms);
    now += timing::kForgetHole - 1s;
    hole.on_reply(now, 80ms);
    now += timing::kForgetHole - 1s;
    hole.on_reply(now, 1ms);
    EXPECT_EQ(hole.learned(), 110ms);
    now += 1s;
    hole.on_reply(now, 1ms);
    EXPECT_EQ(hole.learned(), 0ms);
    for (int i = 0; i < 9; ++i) hole.on_broken(now, 400ms, 500ms);
    EXPECT_EQ(hole.learned(), 500ms) << "no longer than the response timeout";
}

class TrailTest : public testing::Test {
  protected:
    /// A reply, followed by bytes or a copy; 0: by nothing.
    void reply(Duration delay = {}, bool is_copy = false) {
        now += 1s;
        trail.on_reply(now);
        if (delay > 0ms) trail.on_followed(now + delay, is_copy);
    }

    Trail trail{40ms};
    TimePoint now = kStart;
};

TEST_F(TrailTest, BytesThatFollowThreeOfEightRepliesAreRestedForSomewhatLongerThanTheyTake) {
    struct Row {
        std::vector<Duration> delays;
        std::size_t without;  ///< replies at the end
        Duration rest;
    };
    const Row rows[] = {
        {{}, 20, 0ms},
        {{4ms, 4ms}, 1, 0ms},             // an accident
        {{4ms, 2ms, 8ms}, 1, 10ms},       // a glitch of the transceiver
        {{4ms, 4ms, 4ms}, 8, 0ms},        // which has ceased
        {{101ms, 101ms, 101ms}, 1, 0ms},  // no trail comes so late
    };
    for (const Row& row : rows) {
        trail = Trail(40ms);
        for (const Duration delay : row.delays) reply(delay);
        for (std::size_t i = 0; i < row.without; ++i) reply();
        EXPECT_EQ(trail.rest(), row.rest);
        if (row.rest > 0ms) EXPECT_EQ(trail.until(), now + row.rest);
        if (row.rest == 0ms) EXPECT_EQ(trail.until(), TimePoint{});
    }
}

TEST_F(TrailTest, T12OneCopyShowsThatRepliesComeTwiceUntilNoneHasComeForTwoMinutes) {
    reply(40ms, true);
    EXPECT_TRUE(trail.copies());
    EXPECT_EQ(trail.rest(), 50ms);
    EXPECT_TRUE(trail.seen());
    EXPECT_EQ(trail.until(), TimePoint{}) << "the copy has come already";
    reply();
    EXPECT_EQ(trail.until(), now + 50ms);
    while (now < kStart + timing::kForgetCopies) reply();
    EXPECT_TRUE(trail.copies());
    reply();
    reply();
    EXPECT_FALSE(trail.copies());
    EXPECT_EQ(trail.rest(), 0ms);
    reply(8ms, true);
    EXPECT_EQ(trail.rest(), 10ms) << "the old delay is forgotten";
}

}  // namespace
}  // namespace panelgate::arbiter::learned_test
