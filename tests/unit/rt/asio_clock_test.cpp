#include "panelgate/rt/asio_clock.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <memory>
#include <string>

namespace panelgate::rt::asio_clock_test {
namespace {

class AsioClockTest : public testing::Test {
  protected:
    auto ring(const char* what) {
        return [this, what] { rung += what; };
    }

    boost::asio::io_context io{1};
    AsioClock clock{io.get_executor()};
    std::unique_ptr<Alarm> alarm = clock.make_alarm();
    std::string rung;
};

TEST_F(AsioClockTest, RingsOnceNotBeforeItsTimeAndNotFromInside) {
    const TimePoint when = clock.now() + 1ms;
    alarm->arm(when, ring("a"));
    EXPECT_EQ(rung, "");
    io.run();
    EXPECT_EQ(rung, "a");
    EXPECT_GE(clock.now(), when);
}

TEST_F(AsioClockTest, ASharpAlarmRingsNeverBeforeItsTimeEither) {
    for (int i = 0; i < 50; ++i) {
        const TimePoint when = clock.now() + 300us;
        bool early = false;
        alarm->arm_sharp(when, [&] { early = clock.now() < when; });
        io.restart();
        io.run();
        EXPECT_FALSE(early);
    }
}

TEST_F(AsioClockTest, WhatIsArmedForLaterRingsOnceAndThen) {
    const TimePoint later = clock.now() + 3ms;
    alarm->arm(clock.now() + 1ms, ring("a"));
    alarm->arm(later, ring("b"));
    io.run();
    EXPECT_EQ(rung, "b");
    EXPECT_GE(clock.now(), later);
}

TEST_F(AsioClockTest, ATimeThatHasPassedRingsFromTheLoop) {
    alarm->arm(clock.now() - 1h, ring("a"));
    EXPECT_EQ(rung, "");
    io.run();
    EXPECT_EQ(rung, "a");
}

TEST_F(AsioClockTest, WhatIsArmedAnewReplacesWhatWasArmed) {
    alarm->arm(clock.now(), ring("a"));
    alarm->arm(clock.now(), ring("b"));
    io.run();
    EXPECT_EQ(rung, "b");
}

/// Both timers are due, so both completions wait in the loop when the first one cancels.
TEST_F(AsioClockTest, ACancelledAlarmDoesNotRingThoughItIsDue) {
    const auto other = clock.make_alarm();
    alarm->arm(clock.now() - 2s, [&] {
        rung += "a";
        other->cancel();
    });
    other->arm(clock.now() - 1s, ring("b"));
    io.run();
    EXPECT_EQ(rung, "a");
    other->arm(clock.now(), ring("c"));
    io.restart();
    io.run();
    EXPECT_EQ(rung, "ac");
}

TEST_F(AsioClockTest, AnAlarmThatIsGoneDoesNotRing) {
    auto other = clock.make_alarm();
    other->arm(clock.now() - 1s, ring("b"));
    alarm->arm(clock.now() - 2s, [&] { other.reset(); });
    io.run();
    EXPECT_EQ(rung, "");
}

TEST_F(AsioClockTest, AlarmsRingInTheOrderOfTheirTimesWhateverTheyWereArmedFor) {
    const TimePoint now = clock.now();
    const auto second = clock.make_alarm();
    const auto third = clock.make_alarm();
    third->arm_sharp(now + 3ms, ring("c"));
    alarm->arm(now + 1ms, ring("a"));
    second->arm(now + 9ms, ring("-"));
    second->arm(now + 2ms, ring("b"));
    io.run();
    EXPECT_EQ(rung, "abc");
}

TEST_F(AsioClockTest, ALoopWithoutAnArmedAlarmEnds) {
    alarm->arm(clock.now() + 1h, ring("a"));
    const auto other = clock.make_alarm();
    other->arm(clock.now(), [&] { alarm->cancel(); });
    io.run();
    EXPECT_EQ(rung, "");
    io.restart();
    alarm->arm(clock.now() + 1ms, ring("b"));
    io.run();
    EXPECT_EQ(rung, "b") << "and it can be used again";
}

TEST(AsioClockEnd, AnAlarmMayOutliveItsClockInAHandlerThatTheLoopHolds) {
    boost::asio::io_context io{1};
    AsioClock clock{io.get_executor()};
    std::shared_ptr<Alarm> alarm = clock.make_alarm();
    alarm->arm(clock.now() + 1h, [] {});
    boost::asio::post(io, [alarm] {});
}

TEST_F(AsioClockTest, AHandlerMayArmItsOwnAlarm) {
    int left = 3;
    std::function<void()> again = [&] {
        rung += "a";
        if (--left > 0) alarm->arm(clock.now(), again);
    };
    alarm->arm(clock.now(), again);
    io.run();
    EXPECT_EQ(rung, "aaa");
}

}  // namespace
}  // namespace panelgate::rt::asio_clock_test
