#include "shared.hpp"

#include <gtest/gtest.h>

#include <string>

#include "support/manual_clock.hpp"

namespace panelgate::tcp_server::own_answers_test {
namespace {

class OwnAnswersTest : public testing::Test {
  protected:
    void wait(char name, bool wanted = true) {
        answers->wait([this, name, wanted] {
            if (wanted) given += name;
            return wanted;
        });
    }

    test::ManualClock clock;
    std::shared_ptr<OwnAnswers> answers = std::make_shared<OwnAnswers>(clock, 2, 1ms);
    std::string given;
};

TEST_F(OwnAnswersTest, P5AFewAreGivenAtOnceTheOthersInTheNextPeriods) {
    EXPECT_TRUE(answers->try_acquire());
    EXPECT_TRUE(answers->try_acquire());
    EXPECT_FALSE(answers->try_acquire());
    for (const char name : {'a', 'b', 'c'}) wait(name);
    EXPECT_EQ(given, "");
    clock.advance(1ms);
    EXPECT_EQ(given, "ab");
    EXPECT_FALSE(answers->try_acquire()) << "one waits";
    clock.advance(1ms);
    EXPECT_EQ(given, "abc");
    EXPECT_TRUE(answers->try_acquire());
    EXPECT_EQ(clock.armed(), 0u);
}

TEST_F(OwnAnswersTest, AnOccasionalClientNeverWaits) {
    for (int n = 0; n < 10; ++n) {
        EXPECT_TRUE(answers->try_acquire());
        clock.pass(1ms);
    }
}

TEST_F(OwnAnswersTest, P9ClientsThatHaveLeftCostTheOthersNoTurn) {
    answers->try_acquire();
    answers->try_acquire();
    for (int n = 0; n < 1000; ++n) wait('x', false);
    wait('a');
    clock.advance(1ms);
    EXPECT_EQ(given, "a");
}

TEST_F(OwnAnswersTest, NoAnswerIsRequestedAfterTheEnd) {
    answers->try_acquire();
    wait('a');
    answers.reset();
    clock.advance(1s);
    EXPECT_EQ(given, "");
}

}  // namespace
}  // namespace panelgate::tcp_server::own_answers_test
