#include "panelgate/rt/log_throttle.hpp"

#include <gtest/gtest.h>

namespace panelgate::rt {
namespace {

constexpr TimePoint kStart{Duration(1h)};

/// How many of these pass when one comes each second for so long.
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

TEST(LogThrottle, WhatCameLastIsToldWhenNothingFollows) {
    LogThrottle throttle;
    const auto say = [&](TimePoint now, const char* line) {
        if (!throttle.pass(now, "write", "press"))
            throttle.hold("write", "press", LogLevel::info, {line});
    };
    for (int i = 0; i < LogThrottle::kIncidents.burst; ++i) say(kStart, "passes");
    for (const char* line : {"one", "two", "three"}) say(kStart + 1s, line);
    EXPECT_TRUE(throttle.take_held(kStart + 1min).empty());
    const auto held = throttle.take_held(kStart + LogThrottle::kIncidents.interval);
    ASSERT_EQ(held.size(), 1u);
    EXPECT_EQ(held[0].line.text, "three");
    EXPECT_EQ(held[0].left_out, 2u);
    EXPECT_TRUE(throttle.take_held(TimePoint::max()).empty()) << "once";
}

TEST(LogThrottle, EachSubjectAndEachEventIsItsOwn) {
    LogThrottle throttle;
    EXPECT_EQ(passed(throttle, kStart, 1min, "floor1 31"), LogThrottle::kIncidents.burst);
    EXPECT_EQ(passed(throttle, kStart, 1min, "floor1 5"), LogThrottle::kIncidents.burst);
    EXPECT_TRUE(throttle.pass(kStart, "collision", "floor1 31"));
}

TEST(LogThrottle, TheNextOneThatPassesTellsHowManyWereLeftOut) {
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
        const TimePoint now = kStart + 1ms * static_cast<int>(i);
        EXPECT_TRUE(throttle.pass(now, "closed", std::to_string(i)));
    }
}

}  // namespace
}  // namespace panelgate::rt
