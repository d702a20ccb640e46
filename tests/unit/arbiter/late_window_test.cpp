#include "panelgate/arbiter/reply_times.hpp"

#include <gtest/gtest.h>

#include <optional>

namespace panelgate::arbiter::late_window_test {
namespace {

constexpr Duration kTimeout = 100ms;

void timely(LateWindow& window, int replies) {
    for (int i = 0; i < replies; ++i) window.on_timely();
}

TEST(LateWindow, StartsAtTheResponseTimeout) {
    EXPECT_EQ(LateWindow(std::nullopt, kTimeout).value(), kTimeout);
}

TEST(LateWindow, StaysWhatItWasConfiguredToBe) {
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
    window.on_late(1h);
    EXPECT_EQ(window.value(), 8 * kTimeout);
}

TEST(LateWindow, P1DoesNotShrinkByAReplyThatIsLessLate) {
    LateWindow window(std::nullopt, kTimeout);
    window.on_late(200ms);
    window.on_late(1ms);
    EXPECT_EQ(window.value(), Duration(300ms));
}

TEST(LateWindow, ShrinksWhileRepliesComeInTimeButNotBelowTheResponseTimeout) {
    LateWindow window(std::nullopt, kTimeout);
    window.on_late(200ms);
    timely(window, LateWindow::kForget - 1);
    EXPECT_EQ(window.value(), Duration(300ms));
    timely(window, 1);
    EXPECT_EQ(window.value(), Duration(200ms));
    timely(window, 10 * LateWindow::kForget);
    EXPECT_EQ(window.value(), kTimeout);
}

TEST(LateWindow, ALateReplyInBetweenMakesItRememberFromThereOn) {
    LateWindow window(std::nullopt, kTimeout);
    window.on_late(200ms);
    timely(window, LateWindow::kForget - 1);
    window.on_late(1ms);
    timely(window, LateWindow::kForget - 1);
    EXPECT_EQ(window.value(), Duration(300ms));
}

TEST(LateWindow, ToBeLateOnceIsNoHabitTwiceIs) {
    LateWindow window(std::nullopt, kTimeout);
    window.on_late(200ms);
    EXPECT_EQ(window.worst(), Duration(0));
    window.on_late(50ms);
    EXPECT_EQ(window.worst(), Duration(200ms));
}

TEST(LateWindow, AHabitIsForgivenAfterManyRepliesInTimeAndItsWorstWithIt) {
    LateWindow window(std::nullopt, kTimeout);
    for (int i = 0; i < 4; ++i) window.on_late(300ms);
    timely(window, LateWindow::kForget);
    EXPECT_EQ(window.worst(), Duration(0));
    window.on_late(20ms);
    window.on_late(10ms);
    EXPECT_EQ(window.worst(), Duration(20ms));
}

}  // namespace
}  // namespace panelgate::arbiter::late_window_test
