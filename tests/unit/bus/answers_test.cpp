#include "answers.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <optional>
#include <string>

namespace panelgate::bus {
namespace {

class AnswersTest : public testing::Test {
  protected:
    /// Writes its name when it is answered.
    Handed to(char name) {
        return {[this, name](const Answer&) { told += name; }, {}};
    }
    void run() {
        io.restart();
        io.poll();
    }

    boost::asio::io_context io{1};
    std::optional<Answers> answers{io.get_executor()};
    std::string told;
};

TEST_F(AnswersTest, GivesThemInTheirOrderWhenTheCallIsOver) {
    answers->add(to('a'), false);
    answers->add(to('b'), false);
    EXPECT_EQ(told, "");
    run();
    EXPECT_EQ(told, "ab");
    run();
    EXPECT_EQ(told, "ab") << "once";
}

TEST_F(AnswersTest, GivesWhatTheLoopBringsWithoutAnotherTurn) {
    answers->add(to('a'), true);
    EXPECT_EQ(told, "");
    answers->hand_over();
    EXPECT_EQ(told, "a");
    run();
    EXPECT_EQ(told, "a");
}

TEST_F(AnswersTest, WhatCameFirstGoesFirst) {
    answers->add(to('a'), false);
    answers->add(to('b'), true);
    answers->hand_over();
    EXPECT_EQ(told, "ab");
    run();
    EXPECT_EQ(told, "ab");
}

TEST_F(AnswersTest, AnswersWhatAnAnswerLeadsToLater) {
    answers->add({[this](const Answer&) {
                      told += 'a';
                      answers->add(to('b'), false);
                      answers->add(to('c'), true);
                      answers->hand_over();
                      told += '.';
                  },
                  {}},
                 true);
    answers->hand_over();
    EXPECT_EQ(told, "a.");
    run();
    EXPECT_EQ(told, "a.bc");
}

TEST_F(AnswersTest, GivesWhatIsLeftAfterItsEnd) {
    answers->add(to('a'), false);
    answers.reset();
    run();
    EXPECT_EQ(told, "a");
}

TEST_F(AnswersTest, MayEndWhileItGives) {
    answers->add({[this](const Answer&) {
                      told += 'a';
                      answers.reset();
                  },
                  {}},
                 true);
    answers->add(to('b'), true);
    answers->hand_over();
    EXPECT_EQ(told, "ab");
}

}  // namespace
}  // namespace panelgate::bus
