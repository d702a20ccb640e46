#include "descriptor_line.hpp"

#include <gtest/gtest.h>

namespace panelgate::line::input_budget_test {
namespace {

constexpr TimePoint kStart{1h};

TEST(InputBudget, TakesABurstAndThenTheRate) {
    InputBudget budget(1000);
    std::size_t taken = 0;
    TimePoint now = kStart;
    for (; now < kStart + 100s; now += 1ms) {
        while (budget.allows(now)) {
            budget.spend(now, 100);
            taken += 100;
        }
    }
    EXPECT_NEAR(static_cast<double>(taken), 100 * 1000, 1000 + 2 * 100);
}

TEST(InputBudget, ReportsWhenItAllowsMore) {
    InputBudget budget(1000);
    while (budget.allows(kStart)) budget.spend(kStart, 100);
    EXPECT_GT(budget.next(), kStart);
    EXPECT_LE(budget.next(), kStart + InputBudget::kBurst);
    EXPECT_TRUE(budget.allows(budget.next()));
}

TEST(InputBudget, InputWithinTheRateIsNeverPaused) {
    InputBudget budget(1000);
    for (TimePoint now = kStart; now < kStart + 10s; now += 100ms) {
        ASSERT_TRUE(budget.allows(now));
        budget.spend(now, 100);
    }
}

TEST(InputBudget, RepliesAreNoFlood) {
    InputBudget budget(1000);
    for (TimePoint now = kStart; now < kStart + 10s; now += 1ms) {
        budget.on_sent();
        ASSERT_TRUE(budget.allows(now));
        budget.spend(now, 500);
    }
}

}  // namespace
}  // namespace panelgate::line::input_budget_test
