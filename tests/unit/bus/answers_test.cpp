#include "answers.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <optional>
#include <string>

namespace panelgate::bus::answers_test {
namespace {

class AnswersTest : public testing::Test {
  protected:
    /// Appends its name when it is answered.
    Delivery to(char name) {
        return {[this, name](const Answer&) { delivered += name; }, {}};
    }
    void run() {
        io.restart();
        io.poll();
    }

    boost::asio::io_context io{1};
    std::optional<Answers> answers{io.get_executor()};
    std::string delivered;
};

TEST_F(AnswersTest, GivesThemInTheirOrderWhenTheCallIsOver) {
    answers->add(to('a'), false);
    answers->add(to('b'), false);
    EXPECT_EQ(delivered, "");
    run();
    EXPECT_EQ(delivered, "ab");
    run();
    EXPECT_EQ(delivered, "ab") << "once";
}

TEST_F(AnswersTest, GivesWhatTheLoopBringsWithoutAnotherTurn) {
    answers->add(to('a'), true);
    EXPECT_EQ(delivered, "");
    answers->deliver();
    EXPECT_EQ(delivered, "a");
    run();
    EXPECT_EQ(delivered, "a");
}

TEST_F(AnswersTest, WhatCameFirstGoesFirst) {
    answers->add(to('a'), false);
    answers->add(to('b'), true);
    answers->deliver();
    EXPECT_EQ(delivered, "ab");
    run();
    EXPECT_EQ(delivered, "ab");
}

TEST_F(AnswersTest, AnswersWhatAnAnswerLeadsToLater) {
    answers->add({[this](const Answer&) {
                      delivered += 'a';
                      answers->add(to('b'), false);
                      answers->add(to('c'), true);
                      answers->deliver();
                      delivered += '.';
                  },
                  {}},
                 true);
    answers->deliver();
    EXPECT_EQ(delivered, "a.");
    run();
    EXPECT_EQ(delivered, "a.bc");
}

TEST_F(AnswersTest, GivesWhatIsLeftAfterItsEnd) {
    answers->add(to('a'), false);
    answers.reset();
    run();
    EXPECT_EQ(delivered, "a");
}

TEST_F(AnswersTest, MayEndWhileItGives) {
    answers->add({[this](const Answer&) {
                      delivered += 'a';
                      answers.reset();
                  },
                  {}},
                 true);
    answers->add(to('b'), true);
    answers->deliver();
    EXPECT_EQ(delivered, "ab");
}

}  // namespace
}  // namespace panelgate::bus::answers_test
