#include "panelgate/tap/habits.hpp"

#include <gtest/gtest.h>

#include <cstdint>

#include "panelgate/base/bytes.hpp"

namespace panelgate::tap::test::habits_test {
namespace {

TEST(Habits, OneSlowReplyOfEightIsNotUsual) {
    Habits habits;
    EXPECT_FALSE(habits.usual_think());
    habits.answered(9ms);
    EXPECT_EQ(habits.usual_think(), 9ms);
    for (int i = 0; i < 14; ++i) habits.answered(7ms);
    habits.answered(40ms);
    EXPECT_EQ(habits.usual_think(), 7ms);
    EXPECT_EQ(habits.longest_think(), 40ms);
    for (int i = 0; i < 32; ++i) habits.answered(12ms);
    EXPECT_EQ(habits.usual_think(), 12ms) << "what was before is forgotten";
}

TEST(Habits, KnowsTheReadsThatItsMasterAsksLast) {
    Habits habits;
    const auto read = [](std::uint8_t i) { return Bytes{1, 3, i, 0, 24}; };
    for (std::uint8_t i = 0; i < 20; ++i) {
        habits.asks(read(i));
        habits.asks(read(0));
    }
    EXPECT_TRUE(habits.has_asked(read(0)));
    EXPECT_TRUE(habits.has_asked(read(19)));
    EXPECT_FALSE(habits.has_asked(read(1)));
}

}  // namespace
}  // namespace panelgate::tap::test::habits_test
