#include "panelgate/arbiter/habits/reply_times.hpp"
#include "panelgate/arbiter/book/timing.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <optional>
#include <vector>

namespace panelgate::arbiter::reply_times_test {
namespace {

constexpr Duration kTimeout = 100ms;

void timely(LateWindow& window, int replies) {
    for (int i = 0; i < replies; ++i) window.on_timely();
}

TEST(RecentTimes, AQuarterSoonerIsSoonerOnlyWhereAHostCanTell) {
    RecentTimes slow;
    RecentTimes quick;
    for (unsigned i = 0; i < RecentTimes::kEnough; ++i) {
        EXPECT_FALSE(slow.is_far_below(1ms)) << "too few are known";
        slow.add(8ms);
        quick.add(40us);
    }
    EXPECT_TRUE(slow.is_far_below(5ms));
    EXPECT_FALSE(slow.is_far_below(7ms));
    EXPECT_FALSE(quick.is_far_below(0us)) << "a native device: that is the host's jitter";
}

TEST(LateWindow, StaysWhatItWasConfiguredToBeOrStartsAtTheResponseTimeout) {
    EXPECT_EQ(LateWindow(std::nullopt, kTimeout).value(), kTimeout);
    LateWindow window(30ms, kTimeout);
    window.on_late(700ms);
    EXPECT_EQ(window.value(), Duration(30ms));
    timely(window, 3 * LateWindow::kForget);
    EXPECT_EQ(window.value(), Duration(30ms));
}

TEST(LateWindow, P1GrowsBeyondTheLatenessSeenAtMostToEightTimeouts) {
    LateWindow window(std::nullopt, kTimeout);
    window.on_late(200ms);
    EXPECT_EQ(window.value(), Duration(300ms));
    window.on_late(1ms);
    EXPECT_EQ(window.value(), Duration(300ms)) << "less late";
    window.on_late(1h);
    EXPECT_EQ(window.value(), 8 * kTimeout);
}

TEST(LateWindow, ShrinksWhileRepliesComeInTimeButNotBelowTheResponseTimeout) {
    LateWindow window(std::nullopt, kTimeout);
    window.on_late(200ms);
    timely(window, LateWindow::kForget - 1);
    window.on_late(1ms);  // it remembers from there on
    timely(window, LateWindow::kForget - 1);
    EXPECT_EQ(window.value(), Duration(300ms));
    timely(window, 1);
    EXPECT_EQ(window.value(), Duration(200ms));
    timely(window, 10 * LateWindow::kForget);
    EXPECT_EQ(window.value(), kTimeout);
}

TEST(LateWindow, ToBeLateTwiceIsAHabitWhichIsForgivenAfterManyRepliesInTime) {
    LateWindow window(std::nullopt, kTimeout);
    window.on_late(300ms);
    EXPECT_EQ(window.worst(), Duration(0));
    window.on_late(50ms);
    EXPECT_EQ(window.worst(), Duration(300ms));
    window.on_late(300ms);
    window.on_late(300ms);
    timely(window, LateWindow::kForget);
    EXPECT_EQ(window.worst(), Duration(0));
    window.on_late(20ms);
    window.on_late(10ms);
    EXPECT_EQ(window.worst(), Duration(20ms)) << "and its worst with it";
}

/// When replies end.
struct ReplyEnd {
    Duration early(Duration reply) const { return wake_latency.early() + drift.early(reply); }
    void on_look(Duration reply, bool whole) {
        wake_latency.on_look(whole);
        drift.on_look(reply, whole);
    }
    WakeLatency wake_latency{};
    Drift drift{};
};

/// Replies that end when `over` says, for a reply of this duration at the line's rate.
template <class Over>
int whole_looks(ReplyEnd& end, int looks, Over over) {
    int whole = 0;
    for (int i = 0; i < looks; ++i) {
        const Duration reply = i % 3 == 0 ? 20ms : 3ms;
        const bool there = reply - end.early(reply) >= over(reply);
        end.on_look(reply, there);
        whole += there ? 1 : 0;
    }
    return whole;
}

double us(Duration d) { return 1e3 * to_milliseconds(d); }

TEST(ReplyEnd, FollowsAPanelWhoseClockIsFastOrSlow) {
    for (const int percent : {-2, 0, 2}) {
        ReplyEnd end;
        EXPECT_EQ(end.early(3ms), 0ms) << "by the rate until a look shows it";
        const auto over = [&](Duration reply) { return reply * (100 + percent) / 100; };
        whole_looks(end, 2000, over);
        EXPECT_NEAR(us(end.early(20ms)), -percent * 200, 60) << percent;
        const int whole = whole_looks(end, 800, over);
        EXPECT_NEAR(whole, 700, 30) << percent;
    }
}

TEST(ReplyEnd, MakesUpForABeginningThatIsNoticedLate) {
    ReplyEnd end;
    whole_looks(end, 2000, [](Duration reply) { return reply - 60us; });
    EXPECT_NEAR(us(end.early(3ms)), 60, 25);
    EXPECT_NEAR(us(end.early(20ms)), 60, 60);
}

TEST(ReplyEnd, IsNeverFarFromWhatTheRateSays) {
    ReplyEnd end;
    whole_looks(end, 5000, [](Duration) { return 0ms; });
    EXPECT_LE(end.early(10ms), 600us);
    whole_looks(end, 5000, [](Duration) { return 1s; });
    EXPECT_GE(end.early(10ms), -600us);
}

TEST(RecentTimes, AreSignificantAfterSixteenValues) {
    RecentTimes times;
    EXPECT_EQ(times.longest(), std::nullopt);
    EXPECT_EQ(times.shortest(), std::nullopt);
    for (int i = 0; i < 15; ++i) times.add(2ms);
    EXPECT_FALSE(times.is_significant());
    for (unsigned i = 0; i < 2 * RecentTimes::kWindow; ++i) {
        times.add(2ms);
        ASSERT_TRUE(times.is_significant()) << i;
    }
}

TEST(RecentTimes, RememberTheExtremesForAWindowAndForgetThemAfterTwo) {
    RecentTimes times;
    for (const Duration seen : {3ms, 400ms, 1ms}) times.add(seen);
    for (unsigned i = 0; i < RecentTimes::kWindow; ++i) times.add(2ms);
    EXPECT_EQ(times.longest(), 400ms);
    EXPECT_EQ(times.shortest(), 1ms);
    for (unsigned i = 0; i < RecentTimes::kWindow; ++i) times.add(2ms);
    EXPECT_EQ(times.longest(), 2ms);
    EXPECT_EQ(times.shortest(), 2ms);
}

class TrailTest : public testing::Test {
  protected:
    /// A reply, followed by unsolicited bytes; 0: by none.
    void reply(Duration delay = {}) {
        now_ += 1s;
        trail_.on_reply(now_);
        if (delay > 0ms) trail_.on_unsolicited(now_ + delay);
    }

    Trail trail_;
    TimePoint now_{1h};
};

TEST_F(TrailTest, WhatComesOftenIsWaitedForSomewhatLongerThanItHasEverLasted) {
    struct Row {
        std::vector<Duration> delays;
        std::size_t without;  ///< replies at the end
        Duration longest;     ///< 0: nothing is expected
    };
    const Row rows[] = {
        {{}, 20, 0ms},                                                     // only replies
        {{5ms, 5ms}, 1, 0ms},                                              // an accident
        {{4ms, 5ms, 6ms}, 1, 6ms},                                         // a habit
        {std::vector<Duration>(20, timing::kLongestTrail + 1ns), 1, 0ms},  // something else
        {std::vector<Duration>(20, 5ms), Trail::kReplies, 0ms},            // it has stopped
    };
    for (const Row& row : rows) {
        trail_ = Trail();
        for (const Duration delay : row.delays) reply(delay);
        for (std::size_t i = 0; i < row.without; ++i) reply();
        EXPECT_FALSE(trail_.seen());
        EXPECT_EQ(trail_.settle_time() > row.longest, row.longest > 0ms);
        EXPECT_LE(trail_.settle_time(), 2 * row.longest);
        EXPECT_EQ(trail_.until(), now_ + trail_.settle_time());
    }
}

TEST_F(TrailTest, NothingWaitsForWhatHasComeAlready) {
    for (int i = 0; i <= Trail::kOften; ++i) reply(5ms);
    EXPECT_TRUE(trail_.seen());
    EXPECT_LE(trail_.until(), now_);
    reply();
    EXPECT_GT(trail_.until(), now_);
}

TEST_F(TrailTest, SeveralPiecesBehindOneReplyAreOneTrailUpToTheLast) {
    for (int i = 0; i < Trail::kOften; ++i) {
        reply(2ms);
        trail_.on_unsolicited(now_ + 8ms);
        trail_.on_unsolicited(now_ + 4ms);
    }
    reply();
    EXPECT_GT(trail_.settle_time(), Duration(8ms));
}

TEST(Turnaround, KnowsTheQuantilesOfTheLastReplies) {
    Turnaround seen;
    EXPECT_FALSE(seen.known());
    for (int i = 1; i <= 200; ++i) seen.add(i * 1ms);
    EXPECT_TRUE(seen.known());
    EXPECT_EQ(seen.quantile(1), Duration(200ms));
    EXPECT_EQ(seen.quantile(0.5), Duration(169ms));
}

TEST(Turnaround, ReachesWhatItsQuantilesAreAtLeast) {
    Turnaround seen;
    for (int i = 1; i <= 90; ++i) {
        seen.add((i * 37 % 50) * 1ms);
        for (const double share : {0.1, 0.5, 0.95, 1.0}) {
            for (int bound = 0; bound <= 51; ++bound)
                EXPECT_EQ(seen.reaches(share, bound * 1ms), seen.quantile(share) >= bound * 1ms);
        }
    }
}

TEST(Turnaround, ReportsOnceThatItIsNearTheTimeoutUntilItHasGoneBack) {
    Turnaround seen;
    for (int round = 0; round < 2; ++round) {
        int told = 0;
        for (const Duration think : {10ms, 85ms}) {
            EXPECT_EQ(told, 0);
            for (int i = 0; i < 100; ++i) {
                seen.add(think);
                told += seen.take_report(100ms) ? 1 : 0;
            }
        }
        EXPECT_EQ(told, 1);
    }
}

}  // namespace
}  // namespace panelgate::arbiter::reply_times_test
