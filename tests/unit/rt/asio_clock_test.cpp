#include "panelgate/rt/asio_clock.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <functional>
#include <memory>
#include <string>
#include <utility>

namespace panelgate::rt::asio_clock_test {
namespace {

class AsioClockTest : public testing::Test {
  protected:
    auto ring(const char* what) {
        return [this, what] { rung += what; };
    }
    /// Runs until no alarm is armed; returns what has rung since the last call.
    std::string run() {
        io.restart();
        io.run();
        return std::exchange(rung, {});
    }

    boost::asio::io_context io{1};
    AsioClock clock{io.get_executor()};
    std::unique_ptr<Alarm> alarm = clock.make_alarm();
    std::unique_ptr<Alarm> other = clock.make_alarm();
    std::string rung;
};

TEST_F(AsioClockTest, RingsOnceNotBeforeItsTimeAndNotFromInside) {
    for (const Duration in : {Duration(1ms), Duration(-1h)}) {
        const TimePoint when = clock.now() + in;
        alarm->arm(when, ring("a"));
        EXPECT_EQ(rung, "");
        EXPECT_EQ(run(), "a");
        EXPECT_GE(clock.now(), when);
    }
}

TEST_F(AsioClockTest, ASharpAlarmRingsNeverBeforeItsTimeEither) {
    for (int i = 0; i < 50; ++i) {
        const TimePoint when = clock.now() + 300us;
        bool early = false;
        alarm->arm_sharp(when, [&] { early = clock.now() < when; });
        run();
        EXPECT_FALSE(early);
    }
}

TEST_F(AsioClockTest, WhatIsArmedAnewReplacesWhatWasArmed) {
    for (const Duration in : {Duration(3ms), Duration(0)}) {
        const TimePoint later = clock.now() + in;
        alarm->arm(clock.now() + in / 3, ring("a"));
        alarm->arm(later, ring("b"));
        EXPECT_EQ(run(), "b");
        EXPECT_GE(clock.now(), later);
    }
}

/// Both timers are due, so both completions wait in the loop when the first one cancels.
TEST_F(AsioClockTest, ACancelledAlarmOrOneThatIsGoneDoesNotRingThoughItIsDue) {
    alarm->arm(clock.now() - 2s, [&] {
        rung += "a";
        other->cancel();
    });
    other->arm(clock.now() - 1s, ring("b"));
    EXPECT_EQ(run(), "a");
    other->arm(clock.now(), ring("c"));
    EXPECT_EQ(run(), "c");
    other->arm(clock.now() - 1s, ring("b"));
    alarm->arm(clock.now() - 2s, [&] { other.reset(); });
    EXPECT_EQ(run(), "");
}

TEST_F(AsioClockTest, AlarmsRingInTheOrderOfTheirTimesWhateverTheyWereArmedFor) {
    const TimePoint now = clock.now();
    const auto third = clock.make_alarm();
    third->arm_sharp(now + 3ms, ring("c"));
    alarm->arm(now + 1ms, ring("a"));
    other->arm(now + 9ms, ring("-"));
    other->arm(now + 2ms, ring("b"));
    EXPECT_EQ(run(), "abc");
}

TEST_F(AsioClockTest, ALoopWithoutAnArmedAlarmEnds) {
    alarm->arm(clock.now() + 1h, ring("a"));
    other->arm(clock.now(), [&] { alarm->cancel(); });
    EXPECT_EQ(run(), "");
    alarm->arm(clock.now() + 1ms, ring("b"));
    EXPECT_EQ(run(), "b") << "and it can be used again";
}

TEST_F(AsioClockTest, AHandlerMayArmItsOwnAlarm) {
    int left = 3;
    std::function<void()> again = [&] {
        rung += "a";
        if (--left > 0) alarm->arm(clock.now(), again);
    };
    alarm->arm(clock.now(), again);
    EXPECT_EQ(run(), "aaa");
}

TEST(AsioClockEnd, AnAlarmMayOutliveItsClockInAHandlerThatTheLoopHolds) {
    boost::asio::io_context io{1};
    AsioClock clock{io.get_executor()};
    std::shared_ptr<Alarm> alarm = clock.make_alarm();
    alarm->arm(clock.now() + 1h, [] {});
    boost::asio::post(io, [alarm] {});
}

TEST(LeadTime, FollowsWhatTwoOfThreeAreLateUpToABound) {
    LeadTime lead;
    LeadTime most;
    TimePoint now{};
    for (int i = 0; i < 10000; ++i) {
        now += 10ms;
        lead.on_rung(now, i % 4 == 0 ? 2ms : 15us, 0us);
        most.on_rung(now, 5ms, 0us);
    }
    EXPECT_GE(lead.lead(), 14us);
    EXPECT_LE(lead.lead(), 17us);
    EXPECT_EQ(most.lead(), LeadTime::kMost);
}

TEST(LeadTime, WatchesTheClockForAThirtiethOfTheTimeAtMost) {
    LeadTime lead;
    TimePoint now{};
    Duration watched{};
    for (int i = 0; i < 100000; ++i) {
        const Duration watch = lead.lead();
        lead.on_rung(now += 500us, LeadTime::kMost, watch);
        watched += watch;
    }
    EXPECT_LE(watched, 50000ms / 30 + 20ms);
    EXPECT_GE(watched, 50000ms / 40);
}

TEST(LeadTime, ALongRestSavesNoMoreThanAMoment) {
    LeadTime lead;
    TimePoint now{};
    lead.on_rung(now += 1h, 80us, 11ms);
    EXPECT_EQ(lead.lead(), 0us);
    lead.on_rung(now += 1h, 80us, 0us);
    EXPECT_GT(lead.lead(), 0us);
}

}  // namespace
}  // namespace panelgate::rt::asio_clock_test
