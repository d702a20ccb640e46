#include "panelgate/arbiter/reply_times.hpp"

#include <gtest/gtest.h>

namespace panelgate::arbiter::reply_end_test {
namespace {

struct ReplyEnd {
    Duration early(Duration reply) const { return wake_latency.early() + drift.early(reply); }
    void on_look(Duration reply, bool whole) {
        wake_latency.on_look(whole);
        drift.on_look(reply, whole);
    }
    WakeLatency wake_latency;
    Drift drift;
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

TEST(ReplyEnd, IsByTheRateUntilALookShowsIt) { EXPECT_EQ(ReplyEnd().early(3ms), 0ms); }

TEST(ReplyEnd, FollowsAPanelWhoseClockIsFastOrSlow) {
    for (const int percent : {-2, 0, 2}) {
        ReplyEnd end;
        const auto over = [&](Duration reply) { return reply * (100 + percent) / 100; };
        whole_looks(end, 2000, over);
        EXPECT_NEAR(us(end.early(20ms)), -percent * 200, 60) << percent;
        const int whole = whole_looks(end, 800, over);
        EXPECT_NEAR(whole, 700, 30) << percent;
    }
}

TEST(ReplyEnd, MakesUpForABeginningThatIsNoticedLate) {
    ReplyEnd end;
    const auto over = [](Duration reply) { return reply - 60us; };
    whole_looks(end, 2000, over);
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

}  // namespace
}  // namespace panelgate::arbiter::reply_end_test
