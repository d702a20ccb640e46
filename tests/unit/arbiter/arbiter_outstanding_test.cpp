// Outstanding replies (P1): no reply answers a request that it was not sent for, also across
// connections.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <optional>

#include "arbiter_fixture.hpp"
#include "panelgate/arbiter/book/outstanding_requests.hpp"
#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::arbiter_outstanding_test {
namespace {

using modbus::encode_adu;

TEST_F(ArbiterTest, OtherStationsAreAskedBetweenTheAttemptsWhenOnlyTheStationIsQuarantined) {
    settings.quarantine = Quarantine::station;
    BusScript script{settings};
    script.submit(17, kRead, 1);
    const Ticket other = script.submit(18, kRead, 2);
    ASSERT_EQ(script.next_sent().value().adu[0], 18);
    answer(script, 18, kReply);
    EXPECT_TRUE(script.answered(other));
    EXPECT_EQ(script.next_sent().value().adu[0], 17);
}

TEST_F(ArbiterTest, P1WhereTheLineRestsAllWaitUntilALateReplyCanNoLongerCome) {
    settings.quarantine = Quarantine::line;
    BusScript script{settings};
    const Ticket silent = script.submit(17, kRead, 1);
    const Ticket other = script.submit(18, kRead, 2);
    ASSERT_EQ(script.next_sent().value().adu[0], 17);  // its retry comes first
    const auto next = script.next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->adu[0], 18);
    EXPECT_EQ(next->at - script.answer(silent).at, 500ms);
    answer(script, 18, kReply);
    EXPECT_EQ(script.answer(other).pdu.value(), kReply);
}

TEST_F(ArbiterTest, P1ALateReplyOfTheSameShapeAnswersNoRequestAndEndsTheRest) {
    expect_no_answer_by_a_late_reply(settings);
}

/// Registers rarely change: the late reply to the first attempt says what the retry's has said.
TEST_F(ArbiterTest, P5OfTwoAttemptsBothAnsweredAlikeTheSecondReplyIsNoCopy) {
    const Bytes other = "03 00 00 00 01"_hex;
    for (const bool is_copy : {false, true}) {
        BusScript script{settings};
        const Ticket read = script.submit(17, kRead);
        if (!is_copy) ASSERT_TRUE(script.next_sent());  // the retry
        answer(script, 17, kReply, 5ms);
        ASSERT_TRUE(script.answered(read));
        script.submit(17, other);
        answer(script, 17, "03 02 00 07"_hex, 5ms);
        script.run_for(100ms);
        script.hear_reply(17, kReply);
        script.run_for(1s);
        script.submit(17, other);
        answer(script, 17, "03 02 00 07"_hex, 5ms);
        const TimePoint free = script.now();
        script.submit(17, "03 00 00 00 02"_hex);
        EXPECT_EQ(script.sent.back().at - free > 50ms || script.next_sent()->at - free > 50ms,
                  is_copy);
    }
}

TEST_F(ArbiterTest, P1BytesBeforeAReplyCouldHaveBegunAreStaleOnARealLine) {
    settings.paced = true;
    BusScript script{settings};
    const Ticket ticket = script.submit(17, kRead);
    script.run_for(1ms);  // the request is still leaving
    script.hear_reply(17, kReply);
    script.run_for(30ms);
    EXPECT_FALSE(script.answered(ticket));
    script.hear_reply(17, reply_number(1));
    EXPECT_EQ(script.answer(ticket).pdu.value(), reply_number(1));
}

TEST_F(ArbiterTest, P1AStationThatSendsItsRepliesTwiceRestsUntilTheSecondHasPassed) {
    bus.submit(17, kRead, 1);
    answer(bus, 17, kReply, 3ms);
    bus.run_for(80ms);
    bus.hear_reply(17, kReply);  // the duplicate
    bus.run_for(200ms);
    bus.submit(17, kRead, 1);
    answer(bus, 17, kReply, 3ms);
    const TimePoint replied = bus.now();
    bus.submit(17, read_at(5), 1);
    bus.submit(18, kRead, 2);
    EXPECT_EQ(bus.next_sent().value().adu[0], 18) << "the others need not wait";
    answer(bus, 18, kReply, 3ms);
    EXPECT_GE(bus.next_sent().value().at - replied, Duration(120ms));
}

TEST_F(ArbiterTest, P1SoItDoesBehindARefusalForBeingBusy) {
    bus.submit(17, kRead, 1);
    answer(bus, 17, kReply, 3ms);
    bus.run_for(80ms);
    bus.hear_reply(17, kReply);  // the duplicate
    bus.run_for(200ms);
    bus.submit(17, read_at(5), 1);
    answer(bus, 17, "83 06"_hex, 3ms);
    const TimePoint replied = bus.now();
    bus.submit(17, "03 00 00 00 01"_hex, 1);
    EXPECT_GE(bus.next_sent(300ms).value().at - replied, Duration(120ms));
}

/// Two reads of station 17, the second of which is answered like the first.
class ArbiterDoubtTest : public ArbiterTest {
  protected:
    ArbiterDoubtTest() {
        for (StationSettings& station : settings.stations) station.retries = 0;
        script.submit(17, read_at(1), 1);
        answer(script, 17, kReply, 3ms);
        doubted = script.submit(17, read_at(2), 2);
        answer(script, 17, kReply, 3ms);
    }

    BusScript script{settings};
    Ticket doubted = 0;
};

TEST_F(ArbiterDoubtTest, P1AnAnswerThatRepeatsAnotherOneIsAskedForOnceMoreWithoutARetry) {
    EXPECT_FALSE(script.answered(doubted));
    const auto again = script.next_sent(100ms);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->kind, FrameKind::retry);
    EXPECT_EQ(again->adu, encode_adu(17, read_at(2)));
    answer(script, 17, reply_number(2), 3ms);
    EXPECT_EQ(script.answer(doubted).pdu.value(), reply_number(2)) << "the first was a duplicate";
}

TEST_F(ArbiterDoubtTest, P1WhatIsDoubtfulIsNoAnswerForThoseWhoHaveLeftEither) {
    script.cancel(2);
    EXPECT_FALSE(script.next_sent(100ms)) << "nobody asks again for nobody";
    EXPECT_EQ(script.answer(doubted).pdu.error(), Fault::cancelled);
}

TEST_F(ArbiterDoubtTest, P5AnAnswerThatComesAgainWhenAskedAgainIsTrustedAndNothingIsOutstanding) {
    ASSERT_TRUE(script.next_sent(100ms));
    answer(script, 17, kReply, 3ms);
    EXPECT_EQ(script.answer(doubted).pdu.value(), kReply);
    script.submit(17, read_at(3), 1);
    EXPECT_TRUE(script.next_sent(60ms));
}

TEST_F(ArbiterDoubtTest, P1AfterADuplicateTheOutstandingReplyAnswersNoOtherRequest) {
    ASSERT_TRUE(script.next_sent(100ms));
    answer(script, 17, reply_number(2), 3ms);
    script.submit(17, read_at(3), 1);
    EXPECT_EQ(script.next_sent(100ms).value().kind, FrameKind::probe)
        << "one of two replies may still come";
    answer(script, 17, reply_number(5));
    script.hear_reply(17, "03 02 00 01"_hex);
    EXPECT_EQ(script.next_sent(100ms).value().adu, encode_adu(17, read_at(3)));
}

TEST_F(ArbiterDoubtTest, P1AStationThatRepeatsADoubtfulAnswerSendsTwiceAndRestsFromThenOn) {
    script.run_for(5ms);
    script.hear_reply(17, kReply);
    ASSERT_EQ(script.answer(doubted).pdu.value(), kReply);
    const TimePoint replied = script.now();
    script.submit(17, read_at(3), 1);
    EXPECT_GE(script.next_sent(200ms).value().at - replied, Duration(5ms))
        << "its duplicate would answer this";
}

/// A panel that needs 20 ms for each answer.
class ArbiterOneBehindTest : public ArbiterTest {
  protected:
    ArbiterOneBehindTest() {
        for (unsigned i = 1; i <= RecentTimes::kEnough; ++i) {
            ask(i);
            answer(script, 17, reply_number(i), 20ms);
        }
    }
    /// A request that leaves at once.
    Ticket ask(unsigned number) {
        script.run_for(10ms);
        return script.submit(17, read_at(number), 1);
    }
    BusScript script{settings};
};

TEST_F(ArbiterOneBehindTest, P1AnUnaskedFrameLongBeforeTheAnswerIsDueIsNone) {
    const Ticket ticket = ask(100);
    answer(script, 17, reply_number(99), 5ms);
    EXPECT_FALSE(script.answered(ticket));
    script.run_for(10ms);
    script.hear_reply(17, reply_number(100));
    EXPECT_EQ(script.answer(ticket).pdu.value(), reply_number(100));
}

TEST_F(ArbiterOneBehindTest, P1AnAnswerThatIsLeftOverIsNotTakenForTheNext) {
    const Ticket first = ask(100);
    const Ticket second = script.submit(17, read_at(101), 2);
    answer(script, 17, reply_number(99), 18ms);
    ASSERT_TRUE(script.answered(first)) << "nobody can tell";
    answer_next(script, 17, reply_number(100));
    EXPECT_FALSE(script.answered(second));
    script.run_for(10ms);
    script.hear_reply(17, reply_number(101));
    EXPECT_EQ(script.answer(second).pdu.value(), reply_number(101));
}

TEST_F(ArbiterOneBehindTest, P1AnExceptionThatAcknowledgesAnnouncesAReplyToNobodyElse) {
    const Ticket first = ask(100);
    answer(script, 17, "83 05"_hex, 20ms);
    ASSERT_EQ(script.answer(first).pdu.value(), "83 05"_hex);
    ask(101);
    EXPECT_FALSE(script.next_sent(150ms)) << "order proves nothing of what is announced";
    script.hear_reply(17, reply_number(100));
    EXPECT_EQ(script.next_sent(100ms).value().adu, encode_adu(17, read_at(101)));
}

TEST_F(ArbiterOneBehindTest, P5AnAnswerThatWasJustQuickIsAskedForOnceMoreAndThenUsual) {
    const Ticket ticket = ask(100);
    answer(script, 17, reply_number(100), 5ms);
    EXPECT_EQ(script.next_sent(100ms).value().kind, FrameKind::retry);
    answer(script, 17, reply_number(101), 5ms);
    EXPECT_EQ(script.answer(ticket).pdu.value(), reply_number(101));
    script.run_for(2s);
    const Ticket next = ask(102);
    answer(script, 17, reply_number(102), 5ms);
    EXPECT_TRUE(script.answered(next));
}

TEST_F(ArbiterTest, P1AfterAReplyThatCameDamagedAndThenWholeTheNextOneMayComeTwiceToo) {
    bus.submit(17, kRead, 1);
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    Bytes damaged = encode_adu(17, kReply);
    damaged[3] ^= 0x10;
    bus.hear_paced(damaged);
    bus.hear_paced(encode_adu(17, kReply));
    const TimePoint replied = bus.now();
    bus.submit(17, read_at(5), 1);
    EXPECT_GE(bus.next_sent(300ms).value().at - replied, timing::kRepeatsDamaged);
}

/// A busy panel reports busy several times and then gives the value: no duplicate.
TEST_F(ArbiterTest, P5AnExceptionThatRepeatsAnotherOneIsNotAskedForOnceMore) {
    for (const unsigned count : {1u, 2u, 3u}) {
        const Ticket asked = bus.submit(17, Writer().u8(3).u16(100).u16(count).take(), 1);
        answer(bus, 17, "83 06"_hex, 3ms);
        EXPECT_FALSE(bus.next_sent(100ms));
        EXPECT_EQ(bus.answer(asked).pdu.value(), "83 06"_hex);
    }
}

TEST_F(ArbiterTest, P1RepliesOutstandingWhenTheLineWasLostAnswerNoRequestWhenItIsBack) {
    bus.submit(17, read_at(1), 1);
    bus.run_to_end_of_request();
    bus.line_down();
    bus.line_up();
    const Ticket same = bus.submit(17, read_at(2), 2);
    const Ticket other = bus.submit(18, read_at(2), 3);
    ASSERT_EQ(bus.next_sent().value().adu[0], 18) << "others need not wait";
    answer(bus, 17, kReply);  // handed to the new connection
    EXPECT_FALSE(bus.answered(other));
    bus.run_for(30ms);
    bus.hear_reply(18, kReply);
    EXPECT_TRUE(bus.answered(other));
    EXPECT_FALSE(bus.answered(same));
    ASSERT_TRUE(bus.next_sent(10ms)) << "nothing is outstanding any more";
    EXPECT_EQ(bus.sent.back().adu[0], 17);
}

TEST_F(ArbiterTest, P1WhereALineStallsAReplyThatMayBeAnOlderOnesProvesNoMoreThanThat) {
    settings.may_stall = true;
    settings.quarantine = Quarantine::station;
    BusScript script{settings};
    const Ticket first = script.submit(17, kRead, 1);
    script.submit(18, kRead, 2);
    while (!script.answered(first)) ASSERT_TRUE(script.next_sent());
    ASSERT_EQ(script.sent.back().adu[0], 18);
    ASSERT_GT(script.sent.size(), 3u) << "both were asked twice";
    answer(script, 18, kReply);  // perhaps of its first request: the second of 17 may come yet
    const std::size_t sent = script.sent.size();
    script.submit(17, kRead, 1);
    script.run_for(900ms);
    EXPECT_EQ(script.sent.size(), sent);
    EXPECT_GT(script.resets, 0);
}

/// The transport may delay replies; a device server that hangs still accepts connections, because
/// its kernel does. A request was sent twice and not answered, then the line was reopened.
class AfterAReset : public ArbiterTest {
  protected:
    AfterAReset() {
        settings.may_stall = true;
        settings.stations[0].late_window = 500ms;
        script.emplace(settings);
        const Ticket first = script->submit(17, read_at(1), 1);
        while (!script->answered(first)) script->run_for(1ms);
        open_anew(2s);
    }
    void open_anew(Duration wait) {
        script->line_down();
        script->line_up();
        script->run_for(wait);
    }
    void ask() {
        const std::size_t before = script->sent.size();
        second = script->submit(17, read_at(2), 1);
        if (script->sent.size() == before) script->next_sent();
        script->run_to_end_of_request();
    }
    bool read_at_2_was_sent() const {
        const Bytes adu = encode_adu(17, read_at(2));
        return std::ranges::any_of(script->sent, [&](const auto& one) { return one.adu == adu; });
    }
    std::optional<BusScript> script;
    Ticket second = 0;
};

TEST_F(AfterAReset, P1EarlierOutstandingRepliesAnswerNoRequest) {
    ask();
    ASSERT_FALSE(read_at_2_was_sent()) << "nothing tells yet that its reply would be its own";
    script->hear_reply(17, kReply);  // the server goes on: the first attempt's
    script->run_for(20ms);
    script->hear_reply(17, "03 06 02 2B 00 00 00 65"_hex);  // the second's
    script->run_for(20ms);
    EXPECT_FALSE(script->answered(second));
    script->hear_reply(17, "03 02 00 01"_hex);  // the reply to the proof
    script->run_for(20ms);
    ASSERT_TRUE(read_at_2_was_sent()) << "nothing is outstanding any more";
    script->hear_reply(17, reply_number(1));
    EXPECT_EQ(script->answer(second).pdu.value(), reply_number(1));
    EXPECT_EQ(script->resets, 0);
}

TEST_F(AfterAReset, P1AfterAProofItRestsUntilOutstandingRepliesCouldHaveCome) {
    ask();
    script->hear_reply(17, "03 02 00 01"_hex);
    const TimePoint proved = script->now();
    script->run_for(600ms);
    EXPECT_FALSE(read_at_2_was_sent());
    ASSERT_TRUE(script->next_sent(500ms));
    EXPECT_TRUE(read_at_2_was_sent());
    EXPECT_GE(script->now() - proved, 900ms) << "the timeout, and as much for being late";
}

/// A device server drops the connection before the request can have left at the line's rate, and
/// takes the next one at once.
TEST_F(ArbiterTest, P1AnAnswerOverTheNextConnectionEndsNoDoubtOfTheOneBefore) {
    settings.may_stall = true;
    BusScript script{settings};
    const auto read = [&](unsigned number) {
        script.submit(17, read_at(number), 1);
        answer(script, 17, reply_number(number), 14ms);
        script.run_for(10ms);
    };
    for (unsigned i = 1; i <= RecentTimes::kEnough; ++i) read(i);
    script.submit(17, read_at(30), 1);
    script.run_for(1ms);
    script.line_down();
    script.line_up();
    script.run_for(50ms);
    const Ticket write = script.submit(17, "10 0B B8 00 01 02 00 15"_hex, 2);
    answer(script, 17, "10 0B B8 00 01"_hex, 30ms);
    ASSERT_TRUE(script.answered(write));
    script.run_for(10ms);
    script.submit(17, read_at(31), 1);
    script.run_for(500ms);
    EXPECT_NE(script.sent.back().adu, encode_adu(17, read_at(31))) << "the first reply may come";
}

TEST_F(AfterAReset, P1AnExceptionMayAnswerAnOutstandingRequest) {
    ask();
    script->hear_reply(17, "83 02"_hex);
    script->run_for(900ms);
    EXPECT_FALSE(read_at_2_was_sent()) << "of which of three is unknown";
    script->hear_reply(17, "83 02"_hex);  // perhaps the answer to the proof, of another length
    const TimePoint last = script->now();
    while (!read_at_2_was_sent()) ASSERT_TRUE(script->next_sent(2s));
    EXPECT_GE(script->now() - last, 900ms) << "the third could have come";
    answer(*script, 17, "83 02"_hex);
    EXPECT_EQ(script->answer(second).pdu.value(), "83 02"_hex);
    EXPECT_EQ(script->resets, 0);
}

TEST_F(AfterAReset, APanelThatIsSilentToAProofComesBackByClientRequests) {
    settings.offline.after = 2;  // it has been silent once
    script->apply(settings);
    ask();
    ASSERT_NE(script->sent.back().adu, encode_adu(17, read_at(1)));
    script->run_for(1s);
    ASSERT_EQ(script->resets, 1);
    EXPECT_FALSE(script->arbiter().health(17).offline()) << "that tells nothing of the panel";
    open_anew(2s);
    ask();
    EXPECT_EQ(script->sent.back().adu, encode_adu(17, read_at(1)));
}

TEST_F(AfterAReset, APanelThatAnswersAProofWronglyComesBackAsWell) {
    ask();
    const Bytes proof = script->sent.back().adu;
    script->hear_reply(17, "03 04 00 01 00 02"_hex);
    script->run_for(1s);
    ASSERT_EQ(script->resets, 1);
    EXPECT_FALSE(script->arbiter().health(17).offline());
    open_anew(2s);
    ask();
    EXPECT_NE(script->sent.back().adu, proof);
}

TEST_F(AfterAReset, P1AfterASecondAnswerItRestsUntilOutstandingRepliesCouldHaveCome) {
    ask();
    script->run_for(1s);
    open_anew(2s);
    ask();
    script->hear_reply(17, kReply);
    script->run_for(800ms);
    ASSERT_FALSE(read_at_2_was_sent());
    script->hear_reply(17, kReply);  // an earlier one: as many may follow as are outstanding
    script->run_for(900ms);
    ASSERT_FALSE(read_at_2_was_sent());
    ASSERT_TRUE(script->next_sent(2s));
    EXPECT_TRUE(read_at_2_was_sent());
    EXPECT_EQ(script->resets, 1) << "none for that";
}

TEST_F(AfterAReset, WhatCannotBeMistakenGoesItselfAndProvesTheTransport) {
    const Ticket write = script->submit(17, kWrite, 1);
    ASSERT_EQ(script->sent.back().adu, encode_adu(17, kWrite)) << "only reads are outstanding";
    answer(*script, 17, kReply);  // the server goes on
    script->hear_reply(17, kWrite);
    EXPECT_EQ(script->answer(write).pdu.value(), kWrite);
    EXPECT_EQ(script->resets, 0);
}

/// Replies to reads and to a write are outstanding, from a connection before the open one.
class AWriteIsOutstanding : public AfterAReset {
  protected:
    AWriteIsOutstanding() {
        const Ticket write = script->submit(17, "06 00 05 00 01"_hex, 1);
        while (!script->answered(write)) script->run_for(10ms);
        open_anew(3s);
        second = script->submit(17, kWrite, 1);
        script->run_to_end_of_request();
    }
};

TEST_F(AWriteIsOutstanding, P4AWriteOfAnotherPlaceGoesAtOnce) {
    EXPECT_EQ(script->sent.back().adu, encode_adu(17, kWrite)) << "its reply names it";
    script->hear_reply(17, kWrite);
    EXPECT_EQ(script->answer(second).pdu.value(), kWrite);
    EXPECT_EQ(script->resets, 0);
}

TEST_F(AWriteIsOutstanding, P1ARefusalOfItAnswersNoOther) {
    script->hear_reply(17, "86 02"_hex);
    EXPECT_FALSE(script->answered(second));
    script->hear_reply(17, kWrite);
    EXPECT_EQ(script->answer(second).pdu.value(), kWrite);
}

/// Found by tests/model/book.pml: over two connections a station's replies may come in any order.
TEST_F(AWriteIsOutstanding, P1ARefusalThatMayBeOfEitherConnectionClosesNeither) {
    script->hear_reply(17, "86 02"_hex);  // of this write
    while (!script->answered(second)) script->run_for(10ms);
    const Bytes earlier = "06 00 05 00 01"_hex;
    const Ticket third = script->submit(17, earlier, 1);
    script->run_for(20ms);
    script->hear_reply(17, earlier);  // the confirmation of the one before the reset
    script->run_for(20ms);
    EXPECT_FALSE(script->answered(third));
}

TEST_F(AfterAReset, P1TheAnswerOfAnotherStationProvesTheTransport) {
    const Ticket other = script->submit(18, kRead, 2);
    answer(*script, 18, kReply);
    ASSERT_TRUE(script->answered(other));
    const std::size_t sent = script->sent.size();
    second = script->submit(17, read_at(2), 1);
    EXPECT_EQ(script->sent.size(), sent) << "outstanding ones may only now have reached 17";
    ASSERT_TRUE(script->next_sent(1s));
    EXPECT_EQ(script->sent.back().adu, encode_adu(17, read_at(2))) << "no more is needed";
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_outstanding_test
