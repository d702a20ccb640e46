#include "run_loop.hpp"

#include <gtest/gtest.h>

namespace panelgate::app::run_loop_test {
namespace {

TEST(Ending, P3WaitsForTheLongestAnswerAndForTenSecondsAtLeast) {
    Ending ending;
    EXPECT_EQ(ending.patience(), 10s);
    ending.longest_answer = 2s;
    EXPECT_EQ(ending.patience(), 10s);
    ending.longest_answer = 10min;
    EXPECT_GT(ending.patience(), 10min);
}

}  // namespace
}  // namespace panelgate::app::run_loop_test
