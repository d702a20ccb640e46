#include "support/manual_clock.hpp"

#include <gtest/gtest.h>

#include <string>

namespace panelgate::test::manual_clock_test {
namespace {

class ManualClockTest : public testing::Test {
  protected:
    auto ring(const char* what) {
        return [this, what] { rung += what; };
    }

    ManualClock clock;
    const TimePoint start = clock.now();
    std::unique_ptr<rt::Alarm> first = clock.make_alarm();
    std::unique_ptr<rt::Alarm> second = clock.make_alarm();
    std::string rung;
};

TEST_F(ManualClockTest, JumpsToTheNextAlarm) {
    first->arm(start + 2s, ring("a"));
    second->arm(start + 1s, ring("b"));
    EXPECT_TRUE(clock.jump());
    EXPECT_EQ(rung, "b");
    EXPECT_EQ(clock.now(), start + 1s);
    EXPECT_TRUE(clock.jump());
    EXPECT_FALSE(clock.jump());
    EXPECT_EQ(rung, "ba");
}

TEST_F(ManualClockTest, AdvancesPastAlarmsThatArmOthers) {
    first->arm(start + 1s, [this] { second->arm(start + 2s, ring("b")); });
    clock.advance(3s);
    EXPECT_EQ(rung, "b");
    EXPECT_EQ(clock.now(), start + 3s);
}

TEST_F(ManualClockTest, WhatIsCancelledArmedAnewOrGoneDoesNotRing) {
    first->arm(start + 1s, ring("a"));
    first->arm(start + 2s, ring("b"));
    second->arm(start + 1s, ring("c"));
    second->cancel();
    clock.advance(3s);
    EXPECT_EQ(rung, "b");
    second->arm(start + 4s, ring("d"));
    second.reset();
    clock.advance(3s);
    EXPECT_EQ(rung, "b");
}

TEST_F(ManualClockTest, TimeMayPassUnnoticed) {
    first->arm(start + 1s, ring("a"));
    clock.pass(2s);
    EXPECT_EQ(rung, "");
    clock.jump();
    EXPECT_EQ(rung, "a");
    EXPECT_EQ(clock.now(), start + 2s);
}

}  // namespace
}  // namespace panelgate::test::manual_clock_test
