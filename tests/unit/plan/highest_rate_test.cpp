#include "panelgate/plan/line_plan.hpp"

#include <gtest/gtest.h>

#include "plant_line.hpp"

namespace panelgate::plan::highest_rate_test {
namespace {

class HighestRateTest : public testing::Test, protected test::PlantLine {
  protected:
    std::optional<HighestRate> rate() const { return highest_rate(line, make_plan(line)); }
    LinePlan at(double times) const { return make_plan(at_intervals(line, 1 / times)); }
};

TEST_F(HighestRateTest, OfAnIdleLineThereIsNone) {
    add("press");
    EXPECT_FALSE(rate());
}

TEST_F(HighestRateTest, PollsCanGoUpToEightyPercent) {
    Station& press = add("press");
    ask(press, 0, 10, 2 * make_plan(line).client_read);
    ASSERT_TRUE(rate());
    EXPECT_NEAR(rate()->times, 1.6, 1e-5);
    EXPECT_FALSE(rate()->changing);
}

TEST_F(HighestRateTest, WhatIsTooMuchWhileValuesChangeIsSlower) {
    add("from");
    add("to");
    copy(0, 50, 150ms).refresh = 60s;
    ASSERT_GT(make_plan(line).most, 1);
    ASSERT_TRUE(rate());
    EXPECT_LT(rate()->times, 1);
    EXPECT_TRUE(rate()->changing);
    EXPECT_NEAR(at(rate()->times).most, kFull, 1e-4);
}

TEST_F(HighestRateTest, ARefreshThatStaysLeavesMoreToTheRest) {
    add("from");
    add("to");
    ask(line.stations[0], 200, 50, 2s);
    copy(0, 10, 10s).refresh = 10s;
    const LinePlan now = make_plan(line);
    ASSERT_TRUE(rate());
    EXPECT_GT(rate()->times, kHigh / now.load) << "writes do not come more often";
    EXPECT_EQ(verdict(at(rate()->times * 0.999)), Verdict::fine);
    EXPECT_NE(verdict(at(rate()->times * 1.001)), Verdict::fine);
}

TEST_F(HighestRateTest, ReadingAgainStopsAtItsLimit) {
    add("from");
    Station& to = add("to");
    to.memory.shown_as = [](const modbus::Span& written) { return std::vector{written}; };
    ask(to, 500, 60, 10s);
    copy(0, 4, 100ms);
    ASSERT_TRUE(rate());
    EXPECT_LT(rate()->times, kHigh / make_plan(line).load) << "slower, it is as much at first";
    EXPECT_NEAR(at(rate()->times).load, kHigh, 1e-4);
}

}  // namespace
}  // namespace panelgate::plan::highest_rate_test
