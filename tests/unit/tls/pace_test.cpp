#include "pace.hpp"

#include <gtest/gtest.h>

#include <string>

namespace panelgate::tls::pace_test {
namespace {

constexpr TimePoint kStart{100s};

TEST(PaceTest, AFewBeginAtOnceAndTheOthersEvenly) {
    Pace pace(100, 1000);
    for (int i = 0; i < 25; ++i) EXPECT_EQ(pace.wait(kStart, "a"), Duration::zero()) << i;
    EXPECT_EQ(pace.wait(kStart, "a"), 10ms);
    EXPECT_EQ(pace.wait(kStart, "a"), 20ms);
    EXPECT_EQ(pace.wait(kStart, "b"), Duration::zero()) << "another address has its own share";
    EXPECT_EQ(pace.wait(kStart + 1s, "a"), Duration::zero());
}

TEST(PaceTest, AllTogetherHaveALimitToo) {
    Pace pace(100, 200);
    Duration longest{};
    for (int i = 0; i < 100; ++i) longest = std::max(longest, pace.wait(kStart, std::to_string(i)));
    EXPECT_EQ(longest, 250ms);
}

TEST(PaceTest, WhoGoesAwayTakesNoTurn) {
    Pace pace(100, 1000);
    for (int i = 0; i < 30; ++i) pace.wait(kStart, "a");
    for (int i = 0; i < 10; ++i) pace.give_back("a");
    EXPECT_EQ(pace.wait(kStart, "a"), Duration::zero());
    pace.give_back("unknown");
}

TEST(PaceTest, RemembersOnlyAddressesThatMatter) {
    Pace pace(100, 1'000'000);
    for (int i = 0; i < 5000; ++i) pace.wait(kStart + i * 1ms, std::to_string(i));
    EXPECT_LE(pace.addresses(), 257U);
}

}  // namespace
}  // namespace panelgate::tls::pace_test
