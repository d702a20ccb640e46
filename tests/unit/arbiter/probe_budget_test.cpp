#include "panelgate/arbiter/station_health.hpp"

#include <gtest/gtest.h>

namespace panelgate::arbiter::probe_budget_test {
namespace {

constexpr TimePoint kStart{1h};

TEST(ProbeBudget, AllowsTheFirstAtOnce) {
    EXPECT_TRUE(ProbeBudget(ProbeBudget::kOffline).allows(kStart));
}

TEST(ProbeBudget, P4SpendingWheneverAllowedStaysAtTheShare) {
    for (const double share : {ProbeBudget::kOffline, ProbeBudget::kFailing}) {
        ProbeBudget budget(share);
        TimePoint now = kStart;
        Duration spent{};
        for (int i = 0; i < 200; ++i) {
            const Duration cost = (1 + i * 37 % 500) * 1ms;
            ASSERT_TRUE(budget.allows(now));
            now += cost;
            spent += cost;
            budget.spend(now, cost);
            now = budget.next();
        }
        EXPECT_NEAR(to_seconds(spent) / to_seconds(now - kStart), share, share / 1000);
    }
}

TEST(ProbeBudget, AllowsNothingBeforeItsTimeAndSomethingThen) {
    ProbeBudget budget(0.2);
    budget.spend(kStart, 100ms);
    EXPECT_FALSE(budget.allows(kStart));
    EXPECT_FALSE(budget.allows(budget.next() - 1ns));
    EXPECT_TRUE(budget.allows(budget.next()));
}

TEST(ProbeBudget, UnusedTimeIsNotSavedUp) {
    ProbeBudget budget(0.2);
    budget.spend(kStart, 100ms);
    const Duration rest = budget.next() - kStart;
    budget.spend(kStart + 1h, 100ms);
    EXPECT_EQ(budget.next() - (kStart + 1h), rest);
}

TEST(ProbeBudget, P4AnExcessIsPaidOffUpToALimit) {
    ProbeBudget budget(0.2);
    for (int i = 1; i <= 3; ++i) budget.spend(kStart + i * 100ms, 100ms, 1h);
    EXPECT_EQ(budget.next(), kStart + 1500ms) << "a fifth of that time was spent";
    EXPECT_FALSE(budget.allows(kStart + 500ms));
    EXPECT_TRUE(budget.allows(kStart + 500ms, 1s)) << "that much is lent";
    for (int i = 4; i <= 100; ++i) budget.spend(kStart + i * 100ms, 100ms, 2s);
    EXPECT_EQ(budget.next(), kStart + 10s + 2s);
    budget.spend(kStart + 11s, 1s, 2s);
    EXPECT_EQ(budget.next(), kStart + 15s) << "one that is dearer is paid in full";
}

TEST(ProbeBudget, IsFreeAgainWhenItIsCleared) {
    ProbeBudget budget(ProbeBudget::kOffline);
    budget.spend(kStart, 10s);
    budget.clear();
    EXPECT_TRUE(budget.allows(kStart));
}

}  // namespace
}  // namespace panelgate::arbiter::probe_budget_test
