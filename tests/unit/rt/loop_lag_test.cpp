#include "panelgate/rt/process.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "support/manual_clock.hpp"

namespace panelgate::rt::loop_lag_test {
namespace {

std::uint64_t samples(const LoopLag& lag) {
    const auto& counts = lag.seconds().counts;
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

TEST(LoopLag, OfALoopThatComesInTimeIsNothing) {
    test::ManualClock clock;
    LoopLag lag(clock);
    lag.start();
    clock.advance(1s);
    EXPECT_EQ(samples(lag), 10u);
    EXPECT_EQ(lag.seconds().counts[0], 10u);
    EXPECT_EQ(lag.seconds().sum, 0.0);
}

TEST(LoopLag, MeasuresHowLongTheLoopWasBlocked) {
    test::ManualClock clock;
    LoopLag lag(clock);
    lag.start();
    clock.pass(LoopLag::kEvery + 130ms);
    clock.advance(LoopLag::kEvery);
    EXPECT_EQ(samples(lag), 2u);
    EXPECT_NEAR(lag.seconds().sum, 0.13, 1e-9);
}

TEST(LoopLag, IsNotTakenBeforeTheStartNorAfterTheEnd) {
    test::ManualClock clock;
    LoopLag lag(clock);
    clock.advance(1s);
    lag.start();
    lag.stop();
    clock.advance(1s);
    EXPECT_EQ(samples(lag), 0u);
}

}  // namespace
}  // namespace panelgate::rt::loop_lag_test
