#include "panelgate/rt/log_throttle.hpp"

#include <gtest/gtest.h>

namespace panelgate::rt::log_throttle_test {
namespace {

constexpr TimePoint kStart{Duration(1h)};

/// Number of lines that pass at one per second for `length`.
int passed(LogThrottle& throttle, TimePoint from, Duration length, std::string_view subject) {
    int lines = 0;
    for (TimePoint now = from; now < from + length; now += 1s)
        lines += throttle.pass(now, "late reply", subject).has_value() ? 1 : 0;
    return lines;
}

TEST(LogThrottle, WhatRepeatsForAnHourIsAtMostTenLines) {
    LogThrottle throttle;
    EXPECT_EQ(passed(throttle, kStart, 1h, "floor1 31"), 8);
    EXPECT_EQ(passed(throttle, kStart + 1h, 1h, "floor1 31"), 6);
}

TEST(LogThrottle, TheLastThrottledLineIsReturnedIfNoneFollows) {
    LogThrottle throttle;
    const auto say = [&](TimePoint now, const char* line) {
        if (!throttle.pass(now, "write", "press"))
            throttle.hold("write", "press", LogLevel::info, {line});
    };
    for (int i = 0; i < LogThrottle::kIncidents.burst; ++i) say(kStart, "passes");
    for (const char* line : {"one", "two", "three"}) say(kStart + 1s, line);
    EXPECT_TRUE(throttle.take_kept(kStart + 1min).empty());
    const auto held = throttle.take_kept(kStart + LogThrottle::kIncidents.interval);
    ASSERT_EQ(held.size(), 1u);
    EXPECT_EQ(held[0].line.text, "three");
    EXPECT_EQ(held[0].left_out, 2u);
    EXPECT_TRUE(throttle.take_kept(TimePoint::max()).empty()) << "once";
}

TEST(LogThrottle, EachSubjectAndEachEventIsItsOwn) {
    LogThrottle throttle;
    EXPECT_EQ(passed(throttle, kStart, 1min, "floor1 31"), LogThrottle::kIncidents.burst);
    EXPECT_EQ(passed(throttle, kStart, 1min, "floor1 5"), LogThrottle::kIncidents.burst);
    EXPECT_TRUE(throttle.pass(kStart, "collision", "floor1 31"));
}

TEST(LogThrottle, TheNextPassReportsHowManyWereLeftOut) {
    LogThrottle throttle;
    for (int i = 0; i < LogThrottle::kIncidents.burst; ++i)
        EXPECT_EQ(throttle.pass(kStart, "late", "1"), std::optional<std::uint64_t>(0));
    for (int i = 0; i < 7; ++i) EXPECT_FALSE(throttle.pass(kStart + 1s, "late", "1"));
    const TimePoint later = kStart + LogThrottle::kIncidents.interval;
    EXPECT_EQ(throttle.pass(later, "late", "1"), std::optional<std::uint64_t>(7));
    EXPECT_FALSE(throttle.pass(later, "late", "1"));
}

TEST(LogThrottle, MoreSubjectsThanItRemembersCostNoMemoryAndLoseNoFirstLine) {
    LogThrottle throttle;
    for (std::size_t i = 0; i < 3 * LogThrottle::kMostSubjects; ++i) {
        const TimePoint now = kStart + LogThrottle::kByEvent.interval * static_cast<int>(i);
        EXPECT_TRUE(throttle.pass(now, "closed", std::to_string(i)));
    }
}

TEST(LogThrottle, AClientThatChangesTheSubjectHasABudgetOfLinesASecond) {
    LogThrottle throttle;
    int lines = 0;
    for (int i = 0; i < 100000; ++i) {
        const TimePoint now = kStart + 100us * i;
        lines += throttle.pass(now, "write", std::to_string(i), LogThrottle::kActions, "10.0.0.7")
                         .has_value()
                     ? 1
                     : 0;
    }
    EXPECT_LE(lines, LogThrottle::kByClient.burst + 10);
    EXPECT_TRUE(throttle.pass(kStart + 10s, "write", "1", LogThrottle::kActions, "10.0.0.8"))
        << "another client has its own";
    EXPECT_TRUE(throttle.pass(kStart + 10s, "closed", "1", LogThrottle::kActions, "10.0.0.7"))
        << "another event, too";
    const auto left_out = throttle.take_left_out(kStart + 2min);
    ASSERT_EQ(left_out.size(), 1u);
    EXPECT_EQ(left_out[0].event, "write");
    EXPECT_EQ(left_out[0].client, "10.0.0.7");
    EXPECT_EQ(left_out[0].count, 100000u - static_cast<unsigned>(lines));
    EXPECT_TRUE(throttle.take_left_out(kStart + 4min).empty()) << "once";
}

TEST(LogThrottle, AnyNumberOfClientsHasABudgetAndNoLineIsLostWithoutACount) {
    LogThrottle throttle;
    constexpr int kLines = 50000;
    std::uint64_t passed = 0;
    for (int i = 0; i < kLines; ++i) {
        const std::string client = "2001:db8::" + std::to_string(i / 100);
        if (throttle.pass(kStart + 100us * i, "write", std::to_string(i), LogThrottle::kActions,
                          client))
            ++passed;
    }
    EXPECT_LE(passed, LogThrottle::kByEvent.burst + 50u);
    std::uint64_t told = 0;
    for (const auto& one : throttle.take_left_out(TimePoint::max())) told += one.count;
    EXPECT_EQ(passed + told, static_cast<std::uint64_t>(kLines));
}

TEST(LogThrottle, ABudgetComesBackWithTime) {
    LogThrottle throttle;
    for (int i = 0; i < 1000; ++i)
        throttle.pass(kStart, "write", std::to_string(i), LogThrottle::kActions, "10.0.0.7");
    const auto passes = [&](TimePoint now) {
        return throttle.pass(now, "write", "new", LogThrottle::kActions, "10.0.0.7").has_value();
    };
    EXPECT_FALSE(passes(kStart));
    EXPECT_TRUE(passes(kStart + LogThrottle::kByClient.interval));
    EXPECT_FALSE(passes(kStart + LogThrottle::kByClient.interval));
}

}  // namespace
}  // namespace panelgate::rt::log_throttle_test
