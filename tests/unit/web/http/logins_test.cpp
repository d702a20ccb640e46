#include "admission.hpp"

#include <gtest/gtest.h>

#include <string>

namespace panelgate::web::logins_test {
namespace {

class LoginsTest : public ::testing::Test {
  protected:
    void fail(unsigned times, const std::string& address = "a") {
        for (unsigned i = 0; i < times; ++i) logins.failed(now, address);
    }
    bool held(const std::string& address = "a") const {
        return logins.hold(now, address) > Duration::zero();
    }
    LoginSettings settings;
    Logins logins{settings};
    TimePoint now{1h};
};

TEST_F(LoginsTest, ThrottleNoAddressForAFewMistakes) {
    fail(settings.free);
    EXPECT_FALSE(held());
}

TEST_F(LoginsTest, ThrottleAnAddressThatGuesses) {
    fail(settings.free + 1);
    EXPECT_EQ(logins.hold(now, "a"), settings.hold);
    EXPECT_FALSE(held("b"));
}

TEST_F(LoginsTest, LookAtAnAddressThatGuessesNoFasterThanItsGuessesAreAnswered) {
    EXPECT_EQ(logins.turn(now, "a"), Duration::zero());
    fail(settings.free + 1);
    EXPECT_EQ(logins.turn(now, "a"), Duration::zero()) << "the first is looked at at once";
    const Duration pause = Duration(1s) / settings.checks_per_second;
    EXPECT_EQ(logins.turn(now, "a"), pause);
    EXPECT_EQ(logins.turn(now, "a"), 2 * pause) << "whether the one before has hung up or not";
    for (int i = 0; i < 1000; ++i) EXPECT_LE(logins.turn(now, "a"), settings.longest_turn);
    EXPECT_EQ(logins.turn(now, "b"), Duration::zero());
    now += settings.longest_turn + pause;
    EXPECT_EQ(logins.turn(now, "a"), Duration::zero());
}

TEST_F(LoginsTest, LeaveTurnsForRightTokensAmongFortyGuessers) {
    fail(settings.remembered);
    const auto held = settings.hold / (Duration(1s) / settings.checks_per_second);
    EXPECT_GT(held, 40 + 10) << "so many turns pass while each of them waits for its answer";
}

TEST_F(LoginsTest, ARightTokenUsesUpNoTurn) {
    fail(settings.free + 10);
    for (int i = 0; i < 5; ++i) {
        EXPECT_EQ(logins.turn(now, "a"), Duration::zero());
        logins.succeeded("a");
    }
}

TEST_F(LoginsTest, ForgiveWithTime) {
    fail(1000);
    now += settings.forgiven_after;
    EXPECT_TRUE(held());
    now += settings.forgiven_after * settings.remembered;
    EXPECT_FALSE(held());
    fail(settings.free);
    EXPECT_FALSE(held());
}

TEST_F(LoginsTest, ForgiveAnAddressWithMoreRightTokensThanWrongOnes) {
    fail(settings.free + 1);
    logins.succeeded("a");
    EXPECT_FALSE(held());
    for (unsigned i = 0; i < 100; ++i) logins.succeeded("a");
    EXPECT_EQ(logins.addresses(), 0u);
    fail(settings.free + 1);
    EXPECT_TRUE(held());
}

TEST_F(LoginsTest, RememberSoManyAddressesAndForgetTheOneThatFailedLongestAgo) {
    fail(settings.free + 1, "old");
    now += 1ms;
    for (unsigned i = 0; i + 1 < settings.addresses; ++i) fail(1, std::to_string(i));
    EXPECT_TRUE(held("old"));
    fail(1, "one more");
    EXPECT_FALSE(held("old"));
    EXPECT_EQ(logins.addresses(), settings.addresses);
}

}  // namespace
}  // namespace panelgate::web::logins_test
