// What order has closed (P1): stations serve in order, and where one does not, its answers to
// earlier requests are no answers to later ones.
#include <gtest/gtest.h>

#include "arbiter_fixture.hpp"
#include "panelgate/arbiter/habits/reply_times.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::arbiter_disorder_test {
namespace {

/// A panel that needs 20 ms for each answer, and has left one read without.
class ArbiterPassedByTest : public ArbiterTest {
  protected:
    static constexpr unsigned kFew = RecentTimes::kEnough / 2 - 1;
    /// Its silence is no reason any more to wait less long.
    static constexpr Duration kLong = 3s;

    ArbiterPassedByTest() { settings.stations[0].retries = 0; }
    /// It gives so many answers, one not, and one to a later request of another length. Then this
    /// one leaves.
    static Ticket ask_behind(BusScript& script, unsigned replies, Duration pause = 10ms) {
        for (unsigned i = 1; i < replies; ++i) {
            script.submit(17, read_at(i), 1);
            answer(script, 17, reply_number(i), 20ms);
            script.run_for(10ms);
        }
        const Ticket missed = script.submit(17, read_at(50), 1);
        while (!script.answered(missed)) script.run_for(1ms);
        const Ticket longer = script.submit(17, "03 00 00 00 01"_hex, 1);
        answer(script, 17, "03 02 00 07"_hex, 20ms);
        EXPECT_TRUE(script.answered(longer));
        script.run_for(pause);
        return script.submit(17, read_at(60), 1);
    }
};

TEST_F(ArbiterPassedByTest, P1WhatIsLaterThanEverMayBeTheOneThatIsMissing) {
    settings.stations[0].late_window = 5s;
    BusScript script{settings};
    const Ticket ticket = ask_behind(script, RecentTimes::kEnough / 2, kLong);
    answer(script, 17, reply_number(50), 100ms);
    script.run_for(2s);
    EXPECT_FALSE(script.answer(ticket).pdu);
}

TEST_F(ArbiterPassedByTest, P5FewAnswersHaveNotShownHowLongAStationNeeds) {
    settings.stations[0].late_window = 5s;
    BusScript script{settings};
    const Ticket ticket = ask_behind(script, kFew, kLong);
    answer(script, 17, reply_number(60), 100ms);
    EXPECT_EQ(script.answer(ticket).pdu.value(), reply_number(60));
}

TEST_F(ArbiterPassedByTest, P1SoMayWhatIsFarSooner) {
    BusScript script{settings};
    const Ticket ticket = ask_behind(script, RecentTimes::kEnough / 2);
    answer(script, 17, reply_number(50), 3ms);
    EXPECT_FALSE(script.answered(ticket));
    script.run_for(17ms);
    script.hear_reply(17, reply_number(60));
    EXPECT_FALSE(script.answered(ticket)) << "one of the two is";
    EXPECT_EQ(script.next_sent(1200ms).value().kind, FrameKind::retry) << "behind what is late";
    answer(script, 17, reply_number(61), 20ms);
    EXPECT_EQ(script.answer(ticket).pdu.value(), reply_number(61));
}

TEST_F(ArbiterPassedByTest, P5WhereNoneIsMissingSoFewHaveNotShownThat) {
    BusScript script{settings};
    for (unsigned i = 1; i < RecentTimes::kEnough; ++i) {
        script.submit(17, read_at(i), 1);
        answer(script, 17, reply_number(i), 20ms);
        script.run_for(10ms);
    }
    const Ticket ticket = script.submit(17, read_at(60), 1);
    answer(script, 17, reply_number(60), 3ms);
    EXPECT_EQ(script.answer(ticket).pdu.value(), reply_number(60));
}

/// The answer repeats another one, and behind it comes what is missing.
TEST_F(ArbiterPassedByTest, P1OfTwoAnswersNeitherIsBelievedWhereOneIsMissing) {
    BusScript script{settings};
    const Ticket ticket = ask_behind(script, kFew);
    answer(script, 17, reply_number(1), 20ms);
    EXPECT_FALSE(script.answered(ticket));
    script.run_for(5ms);
    script.hear_reply(17, reply_number(50));
    EXPECT_FALSE(script.answered(ticket));
    EXPECT_EQ(script.next_sent(1200ms).value().kind, FrameKind::retry) << "behind what is late";
    answer(script, 17, reply_number(60), 20ms);
    EXPECT_EQ(script.answer(ticket).pdu.value(), reply_number(60));
}

/// It sends two that differ at times, so each is held for another one.
TEST_F(ArbiterPassedByTest, P5WhatIsHeldForAnotherAnswerIsBelievedIfNoneFollows) {
    BusScript script{settings};
    for (const unsigned number : {1u, 2u}) {
        script.submit(17, read_at(number), 1);
        answer(script, 17, reply_number(number), 20ms);
        script.run_for(10ms);
        script.hear_reply(17, reply_number(10 + number));
        script.run_for(100ms);
    }
    const Ticket missed = script.submit(17, read_at(50), 1);
    while (!script.answered(missed)) script.run_for(1ms);
    const Ticket longer = script.submit(17, "03 00 00 00 01"_hex, 1);
    answer(script, 17, "03 02 00 07"_hex, 20ms);
    while (!script.answered(longer)) script.run_for(1ms);
    script.run_for(10ms);
    const Ticket ticket = script.submit(17, read_at(60), 1);
    const std::size_t sent = script.sent.size();
    answer(script, 17, reply_number(60), 20ms);
    EXPECT_FALSE(script.answered(ticket)) << "another one may follow";
    script.run_for(100ms);
    EXPECT_EQ(script.answer(ticket).pdu.value(), reply_number(60));
    EXPECT_EQ(script.sent.size(), sent) << "it was not asked again";
}

/// An answer to an earlier request shows that the station does not serve in order: so may the next.
TEST_F(ArbiterPassedByTest, P1WhoIsSeenToServeOutOfOrderIsBelievedNoneOfThemMeanwhile) {
    BusScript script{settings};
    for (const unsigned number : {1u, 2u}) {
        script.submit(17, read_at(number), 1);
        answer(script, 17, reply_number(number), 20ms);
    }
    script.run_for(10ms);
    const Ticket missed = script.submit(17, read_at(50), 1);
    const Ticket coils = script.submit(17, "01 00 00 00 04"_hex, 1);
    while (!script.answered(missed) || !script.answered(coils)) script.run_for(1ms);
    script.submit(17, "03 00 00 00 01"_hex, 1);
    answer(script, 17, "03 02 00 07"_hex, 20ms);
    const Ticket ticket = script.submit(17, read_at(60), 1);
    answer(script, 17, "01 01 03"_hex, 5ms);
    script.run_for(5ms);
    script.hear_reply(17, reply_number(50));
    script.run_for(2s);
    EXPECT_FALSE(script.answer(ticket).pdu);
}

/// P6: the value was read before the write, and is said behind it, out of turn.
TEST_F(ArbiterPassedByTest, P1AnEarlierReadOfWhatWasWrittenSinceAnswersNoLaterOne) {
    for (const Duration after : {Duration{20ms}, Duration{100ms}}) {
        settings.stations[0].late_window = 5s;
        BusScript script{settings};
        ask_behind(script, RecentTimes::kEnough / 2, kLong);
        answer(script, 17, reply_number(60), 20ms);
        script.run_for(10ms);
        script.submit(17, "06 13 88 00 07"_hex, 1);
        answer(script, 17, "06 13 88 00 07"_hex, 20ms);
        script.run_for(10ms);
        const Ticket ticket = script.submit(17, read_at(50), 1);
        answer(script, 17, reply_number(50), after);
        EXPECT_FALSE(script.answered(ticket)) << after.count();
        if (after == Duration{20ms}) {
            ASSERT_TRUE(script.next_sent(5s)) << "asked again";
            answer(script, 17, reply_number(70), 20ms);
            EXPECT_EQ(script.answer(ticket).pdu.value(), reply_number(70));
        } else {
            script.run_for(2s);
            EXPECT_FALSE(script.answer(ticket).pdu);
        }
    }
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_disorder_test
