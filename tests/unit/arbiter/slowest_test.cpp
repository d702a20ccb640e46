#include "panelgate/arbiter/reply_times.hpp"

#include <gtest/gtest.h>

namespace panelgate::arbiter::slowest_test {
namespace {

TEST(Slowest, KnowsNothingAtFirst) { EXPECT_EQ(Slowest().value(), std::nullopt); }

TEST(Slowest, IsTheLongest) {
    Slowest slowest;
    for (const Duration seen : {3ms, 9ms, 5ms}) slowest.add(seen);
    EXPECT_EQ(slowest.value(), 9ms);
}

TEST(Slowest, IsSignificantAfterSixteenValues) {
    Slowest slowest;
    for (int i = 0; i < 15; ++i) slowest.add(2ms);
    EXPECT_FALSE(slowest.is_significant());
    for (int i = 0; i < 2 * Slowest::kWindow; ++i) {
        slowest.add(2ms);
        ASSERT_TRUE(slowest.is_significant()) << i;
    }
}

TEST(Slowest, RemembersForAWindowAndForgetsAfterTwo) {
    Slowest slowest;
    slowest.add(400ms);
    for (int i = 0; i < Slowest::kWindow; ++i) slowest.add(2ms);
    EXPECT_EQ(slowest.value(), 400ms);
    for (int i = 0; i < Slowest::kWindow; ++i) slowest.add(2ms);
    EXPECT_EQ(slowest.value(), 2ms);
}

}  // namespace
}  // namespace panelgate::arbiter::slowest_test
