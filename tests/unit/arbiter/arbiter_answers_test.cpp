#include "arbiter_fixture.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "panelgate/modbus/rtu_frame.hpp"

/// P1: of which request an answer is, where its own time or another answer speaks against it.
namespace panelgate::arbiter::arbiter_answers_test {
namespace {

using modbus::encode_adu;

/// So soon that one before the request has left is not far sooner.
constexpr Duration kAtOnce = 1ms;

TEST_F(ArbiterAnswersTest, P1AFrameBeforeTheRequestHasLeftIsNoReplyWhereNoneComesSoSoon) {
    const Ticket first = ask(200);
    script.hear_reply(17, reply_number(900));
    ASSERT_TRUE(script.answered(first)) << "nobody can tell yet";
    know();
    for (unsigned i = 201; i < 210; ++i) {
        const Ticket ticket = ask(i);
        const std::size_t sent = script.sent.size();
        script.hear_reply(17, reply_number(900));
        EXPECT_FALSE(script.answered(ticket));
        script.run_to_end_of_request();
        script.run_for(12ms);
        script.hear_reply(17, reply_number(i));
        EXPECT_EQ(value(ticket), reply_number(i));
        EXPECT_EQ(script.sent.size(), sent) << "in the same attempt";
    }
}

TEST_F(ArbiterAnswersTest, P5APanelThatHasBecomeFasterThanItsRequestIsBelievedWhenAskedAgain) {
    know();
    const Ticket ticket = ask(200);
    script.hear_reply(17, reply_number(200));
    for (unsigned i = 201; i < 203; ++i) {
        ASSERT_TRUE(script.next_sent(200ms));
        script.hear_reply(17, reply_number(i));
    }
    EXPECT_EQ(value(ticket), reply_number(202));
    script.run_for(2s);
    const Ticket next = ask(203);
    script.hear_reply(17, reply_number(203));
    EXPECT_TRUE(script.answered(next));
}

/// Values change, so the second answer differs: a native TCP device, on a line said to be slow.
TEST_F(ArbiterAnswersTest, P5WhereEarlyAnswersAreAllThatComesThreeShowThatSoTheyComeHere) {
    know(17, kAtOnce);
    for (unsigned i = 200; i < 203; ++i) ask_behind_an_early(i, reply_number(i));
    const Ticket ticket = ask(203);
    script.hear_reply(17, reply_number(203));
    EXPECT_TRUE(script.answered(ticket));
}

TEST_F(ArbiterAnswersTest, P1EarlyAnswersThatRepeatOthersOrThatAnotherOneFollowedShowNothing) {
    know(17, kAtOnce);
    for (unsigned i = 206; i < 210; ++i) {
        ask_behind_an_early(i, reply_number(i));
        const Ticket followed = ask(300 + i);
        script.hear_reply(17, reply_number(100 + i));
        answer(script, 17, reply_number(300 + i), 12ms);
        EXPECT_EQ(value(followed), reply_number(300 + i));
        script.run_for(2s);
    }
    for (unsigned i = 200; i < 206; ++i) ask_behind_an_early(i, reply_number(1));
    const Ticket ticket = ask(210);
    script.hear_reply(17, reply_number(210));
    EXPECT_FALSE(script.answered(ticket));
}

TEST_F(ArbiterAnswersTest, P1TheAnswerToAnotherReadIsAskedForOnceMoreHoweverOldItIs) {
    read(17, 1);
    script.run_for(5s);
    const Ticket ticket = ask(2);
    answer(script, 17, reply_number(1), 12ms);
    EXPECT_FALSE(script.answered(ticket));
    EXPECT_EQ(script.next_sent(100ms).value().adu, encode_adu(17, read_at(2)));
    answer(script, 17, reply_number(2), 12ms);
    EXPECT_EQ(value(ticket), reply_number(2));
}

TEST_F(ArbiterAnswersTest, P1WhereEachAnswerIsAnOldOneThereIsNone) {
    for (const unsigned i : {1u, 2u, 3u}) read(17, i);
    const Ticket ticket = ask(4);
    for (const unsigned i : {1u, 2u, 3u}) {
        answer(script, 17, reply_number(i), 12ms);
        EXPECT_EQ(script.next_sent(200ms).has_value(), i < 3);
    }
    EXPECT_EQ(script.answer(ticket).pdu.error(), Fault::timeout);
}

TEST_F(ArbiterAnswersTest, P1TwoAnswersAtOnceThatDifferAreNone) {
    read(17, 1);
    const Ticket ticket = ask(2);
    script.run_to_end_of_request();
    script.run_for(12ms);
    Bytes both = encode_adu(17, reply_number(9));
    const Bytes second = encode_adu(17, reply_number(8));
    both.insert(both.end(), second.begin(), second.end());
    script.hear(both);
    EXPECT_FALSE(script.answered(ticket));
    EXPECT_EQ(script.next_sent(100ms).value().adu, encode_adu(17, read_at(2)));
    answer(script, 17, reply_number(2), 12ms);
    EXPECT_EQ(value(ticket), reply_number(2));
}

TEST_F(ArbiterAnswersTest, P1APanelThatSendsASurplusAnswerIsBelievedWhenNoneFollows) {
    knows_surplus();
    const Ticket ticket = ask(50);
    answer(script, 17, reply_number(40), 12ms);
    EXPECT_FALSE(script.answered(ticket));
    script.run_for(4ms);
    script.hear_reply(17, reply_number(50));
    EXPECT_FALSE(script.answered(ticket)) << "one of two";
    EXPECT_EQ(script.next_sent(100ms).value().adu, encode_adu(17, read_at(50)));
    answer(script, 17, reply_number(51), 12ms);
    script.run_for(20ms);
    EXPECT_EQ(value(ticket), reply_number(51));
    EXPECT_EQ(std::ranges::count(script.notes, FrameKind::copy, &Note::kind), 0) << "of nothing";
}

TEST_F(ArbiterAnswersTest, P1OfTwoAnswersInEachAttemptTheOneIsGivenThatBothHad) {
    knows_surplus();
    const Ticket ticket = ask(50);
    answer_twice(50, 700);
    EXPECT_FALSE(script.answered(ticket));
    ASSERT_TRUE(script.next_sent(100ms));
    answer_twice(50, 701);
    EXPECT_EQ(value(ticket), reply_number(50));
}

TEST_F(ArbiterAnswersTest, P1WhereAllAnswersOfTwoAttemptsDifferAThirdDecides) {
    knows_surplus();
    for (const bool is_sure : {true, false}) {
        const Ticket ticket = ask(50);
        answer_twice(50, 700);
        ASSERT_TRUE(script.next_sent(100ms));
        answer_twice(51, 701);
        EXPECT_FALSE(script.answered(ticket));
        ASSERT_TRUE(script.next_sent(100ms));
        answer(script, 17, reply_number(52), 12ms);
        if (!is_sure) {
            script.run_for(4ms);
            script.hear_reply(17, reply_number(702));
        }
        script.run_for(50ms);
        EXPECT_EQ(value(ticket), is_sure ? reply_number(52) : Bytes{});
        script.run_for(2s);
    }
}

TEST_F(ArbiterAnswersTest, P1AnotherAnswerThatHasBegunBehindTheFirstContradictsIt) {
    for (const std::size_t begun : {1u, 3u, 6u, 10u}) {
        BusScript line{settings};
        line.submit(17, read_at(1), 1);
        answer(line, 17, reply_number(1), 12ms);
        line.run_for(10ms);
        const Ticket ticket = line.submit(17, read_at(2), 1);
        line.run_to_end_of_request();
        line.run_for(12ms);
        Bytes both = encode_adu(17, reply_number(9));
        const std::size_t first = both.size() + begun;
        const Bytes second = encode_adu(17, reply_number(2));
        both.insert(both.end(), second.begin(), second.end());
        line.hear(ByteView(both).first(first));
        EXPECT_FALSE(line.answered(ticket)) << begun;
        line.run_for(4ms);
        line.hear(ByteView(both).subspan(first));
        EXPECT_FALSE(line.answered(ticket)) << begun;
        EXPECT_EQ(line.next_sent(100ms).value().adu, encode_adu(17, read_at(2)));
        answer(line, 17, reply_number(2), 12ms);
        EXPECT_EQ(line.answer(ticket).pdu.value(), reply_number(2));
    }
}

TEST_F(ArbiterAnswersTest, P1ASurplusAnswerWithAHoleInItTeachesThatSuchOnesCome) {
    for (const unsigned i : {1u, 20u}) {
        read(17, i);
        const Bytes other = encode_adu(17, reply_number(500 + i));
        script.run_for(1ms);
        script.hear(ByteView(other).first(5));
        script.run_for(4ms);
        script.hear(ByteView(other).subspan(5));
        for (unsigned k = 1; k < 10; ++k) read(17, i + k);
    }
    const Ticket ticket = ask(50);
    answer(script, 17, reply_number(40), 12ms);
    EXPECT_FALSE(script.answered(ticket)) << "another one may follow";
}

TEST_F(ArbiterAnswersTest, P5WhereTheReplyBeforeComesOnceMoreBehindAReplyNothingIsWaitedFor) {
    const auto register_at = [](unsigned i) { return Writer().u8(3).u16(i).u16(1).take(); };
    know();
    for (unsigned i = 0; i < 8; ++i) {
        read(17, 100 + i);
        script.submit(17, register_at(i), 1);
        ASSERT_TRUE(script.next_sent(1s));
        script.run_to_end_of_request();
        script.run_for(12ms);
        Bytes both = encode_adu(17, Writer().u8(3).u8(2).u16(900 + i).take());
        const Bytes before = encode_adu(17, reply_number(100 + i));
        both.insert(both.end(), before.begin(), before.end());
        script.hear(both);
        script.run_for(1s);
    }
    read(17, 200);
    script.submit(17, read_at(201), 1);
    EXPECT_TRUE(script.next_sent(20ms).has_value());
}

/// Its answer may have been slow, or its frames late.
TEST_F(ArbiterAnswersTest, P1AReplyIsAmbiguousWhileWhatAnotherMasterAskedBeforeIsUnanswered) {
    settings.echo = EchoMode::off;
    BusScript bus(settings);
    bus.submit(17, kRead);
    answer(bus, 17, kReply);
    bus.run_for(10ms);
    bus.hear(encode_adu(17, "03 00 00 00 03"_hex));
    bus.run_for(10ms);
    const Ticket ticket = bus.submit(17, kRead);
    ASSERT_TRUE(bus.next_sent(300ms));
    answer(bus, 17, reply_number(1));
    EXPECT_FALSE(bus.answered(ticket));
    ASSERT_TRUE(bus.next_sent(200ms));
    answer(bus, 17, reply_number(2));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), reply_number(2)) << "that is over";
}

TEST_F(ArbiterAnswersTest, P1AReplyBehindAnotherMastersRequestThatCameWhileOursLeftIsAmbiguous) {
    settings.echo = EchoMode::off;
    settings.paced = true;
    const Bytes theirs = encode_adu(17, "03 00 00 00 03"_hex);
    for (const std::size_t before : {3u, 8u}) {
        BusScript bus(settings);
        const Ticket ticket = bus.submit(17, kRead);
        bus.hear(ByteView(theirs).first(before));
        bus.run_to_end_of_request();
        if (before < theirs.size()) bus.hear_paced(ByteView(theirs).subspan(before));
        bus.run_for(5ms);
        bus.hear_paced(encode_adu(17, reply_number(1)));
        EXPECT_FALSE(bus.answered(ticket)) << before;
    }
}

/// A busy machine, or an adapter that passes bytes on now and then, puts a pause into it.
TEST_F(ArbiterAnswersTest, P1AnotherMastersRequestThatCameInTwoPiecesMakesAReplyAmbiguous) {
    know();
    for (const bool behind : {false, true}) {
        const Bytes other = encode_adu(17, read_at(90));
        script.run_for(200ms);
        if (!behind) script.submit(18, read_at(1), 1);
        if (!behind) script.run_to_end_of_request();
        script.hear(ByteView(other).first(5));
        script.run_for(3ms);
        script.hear(ByteView(other).subspan(5));
        if (!behind) script.run_for(3ms);
        if (!behind) script.hear_reply(18, reply_number(1));
        const Ticket ticket = ask(40);
        answer(script, 17, reply_number(90));
        EXPECT_FALSE(script.answered(ticket)) << behind;
        script.run_for(12ms);
        script.hear_reply(17, reply_number(40));
        ASSERT_TRUE(script.next_sent(200ms));
        answer(script, 17, reply_number(41), 12ms);
        EXPECT_EQ(value(ticket), reply_number(41)) << behind;
        const std::size_t sent = script.sent.size();
        const Ticket next = ask(42);
        ASSERT_EQ(script.sent.size(), sent + 1) << "both were answered: nothing is outstanding";
        answer(script, 17, reply_number(42), 12ms);
        EXPECT_EQ(value(next), reply_number(42));
    }
}

/// A foreign request in front is no part of the reply: that came in time.
TEST_F(ArbiterAnswersTest, P1AReplyBehindARequestToAnotherPanelIsTaken) {
    know();
    const Ticket ticket = ask(40);
    script.hear(encode_adu(18, read_at(90)));
    script.run_to_end_of_request();
    script.run_for(12ms);
    script.hear_reply(17, reply_number(40));
    EXPECT_EQ(value(ticket), reply_number(40));
}

TEST_F(ArbiterAnswersTest, P5WhenAnotherMasterHasItsAnswerTheLineIsFree) {
    know();
    script.run_for(200ms);
    script.hear(encode_adu(18, read_at(90)));
    const std::size_t sent = script.sent.size();
    script.run_for(3ms);
    script.submit(17, read_at(40), 1);
    script.run_for(5ms);
    EXPECT_EQ(script.sent.size(), sent);
    script.hear_reply(18, reply_number(90));
    const TimePoint from = script.now();
    ASSERT_TRUE(script.next_sent(100ms));
    EXPECT_LE(script.now() - from, settings.end_of_frame);
}

/// A converter that gives each request back behind the reply.
TEST_F(ArbiterAnswersTest, P5NothingIsWaitedForWhereOurOwnFrameHasBegunBehindAReply) {
    know();
    const Ticket ticket = ask(40);
    script.run_to_end_of_request();
    script.run_for(12ms);
    Bytes both = encode_adu(17, reply_number(40));
    both.insert(both.end(), {17, 3});
    script.hear(both);
    EXPECT_FALSE(script.answered(ticket)) << "another answer may have begun";
    script.hear(ByteView(encode_adu(17, read_at(40))).subspan(2));
    EXPECT_EQ(value(ticket), reply_number(40));
}

TEST_F(ArbiterAnswersTest, P4AReplyWithoutItsFirstByteIsDamagedAndNotSilence) {
    settings.stations[0].retries = 0;
    for (const std::size_t lost : {1u, 2u, 3u}) {
        BusScript line{settings};
        const Ticket ticket = line.submit(17, kRead, 1);
        line.run_to_end_of_request();
        line.run_for(8ms);
        const Bytes whole = encode_adu(17, kReply);
        line.hear(ByteView(whole).subspan(lost));
        line.run_for(60ms);
        EXPECT_EQ(line.answer(ticket).pdu.error(), Fault::damaged) << lost;
    }
}

TEST_F(ArbiterAnswersTest,
       P1ARefusalThatMayHaveAnotherFunctionsNumberIsAskedForAgainAlsoIfItCameTwice) {
    know();
    const Ticket first = ask(100);
    while (!script.answered(first)) script.run_for(1ms);
    const Ticket second = script.submit(17, "04 00 0A 00 04"_hex, 2);
    answer(script, 17, "84 02"_hex, 12ms);  // it may be that to the first, late
    script.run_for(4ms);
    script.hear_reply(17, "84 02"_hex);
    EXPECT_FALSE(script.answered(second));
    answer_next(script, 17, "04 08 00 01 00 02 00 03 00 04"_hex, 12ms);
    EXPECT_EQ(value(second), "04 08 00 01 00 02 00 03 00 04"_hex);
}

TEST_F(ArbiterAnswersTest, P1TheLastReplyOfEachFunctionMayBeSaidOnceMore) {
    know();
    script.submit(17, "18 05 29"_hex, 1);
    answer(script, 17, "18 00 06 00 02 5F 73 00 0A"_hex, 12ms);
    for (unsigned i = 0; i < 12; ++i) read(17, 30 + i);
    script.run_for(10ms);
    const Ticket other = script.submit(17, "18 04 BD"_hex, 1);
    answer(script, 17, "18 00 06 00 02 5F 73 00 0A"_hex, 12ms);
    script.run_for(100ms);
    EXPECT_FALSE(script.answered(other));
}

/// P2, P8: where a line has kept pace so far a confirmation that repeats one, and comes sooner than
/// computed, is neither believed nor thrown away: a read tells.
TEST_F(ArbiterAnswersTest, P8AnEarlyConfirmationThatRepeatsOneIsReadBack) {
    const Bytes write = "10 00 64 00 02 04 00 0B 00 0C"_hex;
    const Bytes confirmed = "10 00 64 00 02"_hex;
    for (const bool is_done : {true, false}) {
        BusScript tcp{settings};
        for (unsigned i = 1; i <= RecentTimes::kEnough; ++i) {
            tcp.submit(17, read_at(i), 1);
            answer(tcp, 17, reply_number(i), 12ms);
            tcp.run_for(10ms);
        }
        tcp.submit(17, "10 00 64 00 02 04 00 01 00 02"_hex, 1);
        answer(tcp, 17, confirmed, 12ms);
        tcp.run_for(10ms);
        const Ticket ticket = tcp.submit(17, write, 1);
        tcp.hear_reply(17, confirmed);
        EXPECT_FALSE(tcp.answered(ticket));
        EXPECT_EQ(tcp.next_sent(300ms).value().adu, encode_adu(17, "03 00 64 00 02"_hex));
        answer(tcp, 17, is_done ? "03 04 00 0B 00 0C"_hex : "03 04 00 01 00 02"_hex, 12ms);
        EXPECT_EQ(tcp.answer(ticket).pdu == Result<Bytes>(confirmed), is_done);
    }
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_answers_test
