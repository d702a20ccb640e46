#include "panelgate/rt/log_throttle.hpp"

#include <gtest/gtest.h>

namespace panelgate::rt::log_repeats_test {
namespace {

constexpr TimePoint kStart{Duration(1h)};
constexpr WallTime kWall{1h};

class LogRepeatsTest : public ::testing::Test {
  protected:
    /// True if it is logged at once.
    bool say(TimePoint now, const std::string& place, const std::string& what) {
        const bool again = repeats.is_repeat(now, place, what);
        const WallTime time = kWall + std::chrono::floor<std::chrono::microseconds>(now - kStart);
        if (again) repeats.gather(place, {what}, time);
        return !again;
    }
    LogRepeats repeats;
};

TEST_F(LogRepeatsTest, DifferentEventsAreLoggedEachTime) {
    for (int i = 0; i < 10000; ++i)
        EXPECT_TRUE(say(kStart + 1ms * i, "press/100", std::to_string(i)));
    EXPECT_TRUE(repeats.take_due(TimePoint::max()).empty());
}

TEST_F(LogRepeatsTest, RepeatsAreMergedIntoOneLineAMinuteWithCountAndTimes) {
    EXPECT_TRUE(say(kStart, "press/100", "7"));
    for (int i = 1; i < 60; ++i) EXPECT_FALSE(say(kStart + 1s * i, "press/100", "7"));
    EXPECT_TRUE(repeats.take_due(kStart + 59s).empty());
    const auto due = repeats.take_due(kStart + 60s);
    ASSERT_EQ(due.size(), 1u);
    EXPECT_EQ(due[0].line.text, "7");
    EXPECT_EQ(due[0].repeated, 59u);
    EXPECT_EQ(due[0].last - due[0].first, 58s);
    EXPECT_FALSE(say(kStart + 61s, "press/100", "7")) << "it goes on";
    EXPECT_EQ(repeats.take_due(kStart + 2min).size(), 1u);
}

TEST_F(LogRepeatsTest, RepeatsAreLoggedBeforeTheNextEvent) {
    say(kStart, "press/100", "7");
    say(kStart + 1s, "press/100", "7");
    EXPECT_TRUE(say(kStart + 2s, "press/100", "8"));
    const auto ended = repeats.take_ended();
    ASSERT_EQ(ended.size(), 1u);
    EXPECT_EQ(ended[0].line.text, "7");
    EXPECT_TRUE(say(kStart + 3s, "press/100", "7")) << "7 again is a change";
}

TEST_F(LogRepeatsTest, ARepeatAfterAMinuteIsLoggedAtOnce) {
    EXPECT_TRUE(say(kStart, "press/100", "7"));
    EXPECT_TRUE(say(kStart + 2min, "press/100", "7"));
    EXPECT_TRUE(say(kStart + 4min, "press/100", "7"));
}

TEST_F(LogRepeatsTest, MorePlacesThanTheLimitLoseNothing) {
    const int places = 3 * static_cast<int>(LogRepeats::kMostPlaces);
    std::uint64_t told = 0;
    for (int i = 0; i < places; ++i) {
        for (int twice = 0; twice < 2; ++twice)
            told += say(kStart + 1ms * i, std::to_string(i), "7") ? 1 : 0;
    }
    for (const auto& one : repeats.take_due(TimePoint::max())) told += one.repeated;
    EXPECT_EQ(told, 2u * static_cast<unsigned>(places));
}

}  // namespace
}  // namespace panelgate::rt::log_repeats_test
