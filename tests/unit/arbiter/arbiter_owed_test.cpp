// Outstanding replies (P1): no reply answers a request that it was not sent for.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "arbiter_fixture.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::arbiter_owed_test {
namespace {

TEST_F(ArbiterTest, OtherStationsAreAskedBetweenTheAttemptsWhenOnlyTheStationIsQuarantined) {
    settings.quarantine = Quarantine::station;
    BusScript script{settings};
    script.submit(17, kRead, 1);
    const Ticket other = script.submit(18, kRead, 2);
    const auto second = script.next_sent();
    ASSERT_TRUE(second);
    EXPECT_EQ(second->adu[0], 18);
    script.run_to_end_of_request();
    script.hear_reply(18, kReply);
    EXPECT_TRUE(script.answered(other));
    EXPECT_EQ(script.next_sent()->adu[0], 17);
}

TEST_F(ArbiterTest, P1WhereTheLineRestsAllWaitUntilALateReplyCanNoLongerCome) {
    settings.quarantine = Quarantine::line;
    BusScript script{settings};
    const Ticket silent = script.submit(17, kRead, 1);
    const Ticket other = script.submit(18, kRead, 2);
    ASSERT_EQ(script.next_sent()->adu[0], 17);  // its retry comes first
    const auto next = script.next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->adu[0], 18);
    ASSERT_TRUE(script.answered(silent));
    EXPECT_EQ(next->at - script.answer(silent).at, 500ms);
    script.run_to_end_of_request();
    script.hear_reply(18, kReply);
    EXPECT_EQ(script.answer(other).pdu.value(), kReply);
}

TEST_F(ArbiterTest, P1ALateReplyOfTheSameShapeAnswersNoRequestAndEndsTheRest) {
    settings.stations[0].retries = 0;
    BusScript script{settings};
    const Ticket first = script.submit(17, read_at(1), 1);
    const Ticket second = script.submit(17, read_at(2), 2);
    while (!script.answered(first)) script.run_for(1ms);
    script.run_for(300ms);
    script.hear_reply(17, kReply);  // of the first: same station, function and length
    script.run_for(100ms);
    EXPECT_FALSE(script.answered(second));
    EXPECT_EQ(script.events.size(), 1u);
    EXPECT_EQ(script.events[0].kind, StationEvent::Kind::late);
    ASSERT_EQ(script.sent.size(), 2u);
    script.hear_reply(17, "03 06 00 01 00 02 00 03"_hex);
    EXPECT_EQ(script.answer(second).pdu.value(), "03 06 00 01 00 02 00 03"_hex);
}

TEST_F(ArbiterTest, P1BytesBeforeAReplyCouldHaveBegunAreStaleOnARealLine) {
    settings.paced = true;
    BusScript script{settings};
    const Ticket ticket = script.submit(17, kRead);
    script.run_for(1ms);  // the request is still leaving
    script.hear_reply(17, kReply);
    script.run_for(30ms);
    EXPECT_FALSE(script.answered(ticket));
    script.hear_reply(17, "03 06 00 01 00 02 00 03"_hex);
    EXPECT_EQ(script.answer(ticket).pdu.value(), "03 06 00 01 00 02 00 03"_hex);
}

TEST_F(ArbiterTest, P1AStationThatSendsItsRepliesTwiceRestsUntilTheSecondHasPassed) {
    const auto ask = [&](Client client) {
        bus.submit(17, kRead, client);
        bus.run_to_end_of_request();
        bus.run_for(3ms);
        bus.hear_reply(17, kReply);
        return bus.now();
    };
    ask(1);
    bus.run_for(80ms);
    bus.hear_reply(17, kReply);  // the duplicate
    bus.run_for(200ms);
    const TimePoint replied = ask(1);
    bus.submit(17, read_at(5), 1);
    bus.submit(18, kRead, 2);
    EXPECT_EQ(bus.next_sent()->adu[0], 18) << "the others need not wait";
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    bus.hear_reply(18, kReply);
    const auto next = bus.next_sent();
    ASSERT_TRUE(next);
    EXPECT_GE(next->at - replied, Duration(120ms));
}

/// Two reads of station 17, the second of which is answered like the first.
class ArbiterDoubtTest : public ArbiterTest {
  protected:
    ArbiterDoubtTest() {
        for (StationSettings& station : settings.stations) station.retries = 0;
        script.submit(17, read_at(1), 1);
        answer(kReply);
        doubted = script.submit(17, read_at(2), 2);
        answer(kReply);
    }
    void answer(const Bytes& reply) {
        script.run_to_end_of_request();
        script.run_for(3ms);
        script.hear_reply(17, reply);
    }

    BusScript script{settings};
    Ticket doubted = 0;
};

TEST_F(ArbiterDoubtTest, P1AnAnswerThatRepeatsAnotherOneIsAskedForOnceMoreWithoutARetry) {
    EXPECT_FALSE(script.answered(doubted));
    const auto again = script.next_sent(100ms);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->kind, FrameKind::retry);
    EXPECT_EQ(again->adu, modbus::encode_adu(17, read_at(2)));
    answer(reply_number(2));
    EXPECT_EQ(script.answer(doubted).pdu.value(), reply_number(2)) << "the first was a copy";
}

TEST_F(ArbiterDoubtTest, P1WhatIsDoubtfulIsNoAnswerForThoseWhoHaveLeftEither) {
    script.cancel(2);
    EXPECT_FALSE(script.next_sent(100ms)) << "nobody asks again for nobody";
    EXPECT_EQ(script.answer(doubted).pdu.error(), Fault::cancelled);
}

TEST_F(ArbiterDoubtTest, P5AnAnswerThatComesAgainWhenAskedAgainIsTrustedAndNothingIsOutstanding) {
    ASSERT_TRUE(script.next_sent(100ms));
    answer(kReply);
    EXPECT_EQ(script.answer(doubted).pdu.value(), kReply);
    script.submit(17, read_at(3), 1);
    EXPECT_TRUE(script.next_sent(60ms));
}

TEST_F(ArbiterDoubtTest, P1AfterADuplicateTheOutstandingReplyAnswersNoOtherRequest) {
    ASSERT_TRUE(script.next_sent(100ms));
    answer(reply_number(2));
    script.submit(17, read_at(3), 1);
    const auto proof = script.next_sent(100ms);
    ASSERT_TRUE(proof);
    EXPECT_EQ(proof->kind, FrameKind::probe) << "one of two replies may still come";
    script.run_to_end_of_request();
    script.hear_reply(17, reply_number(5));
    script.hear_reply(17, "03 02 00 01"_hex);
    EXPECT_EQ(script.next_sent(100ms)->adu, modbus::encode_adu(17, read_at(3)));
}

TEST_F(ArbiterDoubtTest, P1AStationThatRepeatsADoubtfulAnswerSendsTwiceAndRestsFromThenOn) {
    script.run_for(5ms);
    script.hear_reply(17, kReply);
    ASSERT_EQ(script.answer(doubted).pdu.value(), kReply);
    const TimePoint replied = script.now();
    script.submit(17, read_at(3), 1);
    const auto next = script.next_sent(200ms);
    ASSERT_TRUE(next);
    EXPECT_GE(next->at - replied, Duration(5ms)) << "its copy would answer this";
}

TEST_F(ArbiterTest, P1AfterAReplyThatCameDamagedAndThenWholeTheNextOneMayComeTwiceToo) {
    bus.submit(17, kRead, 1);
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    Bytes damaged = modbus::encode_adu(17, kReply);
    damaged[3] ^= 0x10;
    bus.hear_paced(damaged);
    bus.hear_paced(modbus::encode_adu(17, kReply));
    const TimePoint replied = bus.now();
    bus.submit(17, read_at(5), 1);
    const auto next = bus.next_sent(300ms);
    ASSERT_TRUE(next);
    EXPECT_GE(next->at - replied, DuplicateGuard::kRepeatDelay);
}

/// A busy panel reports busy twice and then gives the value: no duplicate.
TEST_F(ArbiterTest, P5AnExceptionThatRepeatsAnotherOneIsNotAskedForOnceMore) {
    const auto refuse = [&](std::uint16_t address) {
        const Ticket asked = bus.submit(17, read_at(address), 1);
        bus.run_to_end_of_request();
        bus.run_for(3ms);
        bus.hear_reply(17, "83 06"_hex);
        EXPECT_FALSE(bus.next_sent(100ms));
        EXPECT_EQ(bus.answer(asked).pdu.value(), "83 06"_hex);
    };
    refuse(1);
    refuse(2);
    refuse(3);
}

TEST_F(ArbiterTest, P1RepliesOutstandingWhenTheLineWasLostAnswerNoRequestWhenItIsBack) {
    bus.submit(17, read_at(1), 1);
    bus.run_to_end_of_request();
    bus.line_down();
    bus.line_up();
    const Ticket same = bus.submit(17, read_at(2), 2);
    const Ticket other = bus.submit(18, read_at(2), 3);
    ASSERT_TRUE(bus.next_sent());
    EXPECT_EQ(bus.sent.back().adu[0], 18) << "others need not wait";
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);  // handed to the new connection
    EXPECT_FALSE(bus.answered(other));
    bus.run_for(30ms);
    bus.hear_reply(18, kReply);
    EXPECT_TRUE(bus.answered(other));
    EXPECT_FALSE(bus.answered(same));
    ASSERT_TRUE(bus.next_sent(10ms)) << "nothing is owed any more";
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
    script.run_to_end_of_request();
    script.hear_reply(18, kReply);  // perhaps of its first request: the second of 17 may come yet
    const std::size_t sent = script.sent.size();
    script.submit(17, kRead, 1);
    script.run_for(900ms);
    EXPECT_EQ(script.sent.size(), sent);
    EXPECT_GT(script.resets, 0);
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_owed_test
