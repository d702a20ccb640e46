#include "arbiter_fixture.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "panelgate/modbus/rtu_frame.hpp"

/// Refusals that a reply may follow, and values that are proved by a read.
namespace panelgate::arbiter::arbiter_refusals_test {
namespace {

using modbus::encode_adu;

class ArbiterAnnouncedTest : public ArbiterAnswersTest,
                             public testing::WithParamInterface<Bytes> {};

TEST_P(ArbiterAnnouncedTest, P1ItAnswersNoOtherReadThatWasAnnouncedToo) {
    know();
    const Ticket first = ask(100);
    answer(script, 17, GetParam(), 12ms);
    ASSERT_EQ(value(first), GetParam());
    const Ticket other = script.submit(17, "03 00 00 00 01"_hex, 2);
    answer_next(script, 17, GetParam(), 12ms);
    script.run_for(50ms);  // it repeats the one before
    ASSERT_EQ(value(other), GetParam());
    const Ticket third = ask(101);
    script.run_for(100ms);
    script.hear_reply(17, reply_number(100));
    EXPECT_FALSE(script.answered(third));
}

TEST_P(ArbiterAnnouncedTest, P4ARefusalBehindItIsThatOfTheNextRequest) {
    know();
    ASSERT_TRUE(ask(100));
    answer(script, 17, GetParam(), 12ms);
    const Ticket other = script.submit(17, "03 00 00 00 01"_hex, 2);
    answer_next(script, 17, "83 02"_hex, 12ms);
    EXPECT_EQ(value(other), "83 02"_hex);
}

INSTANTIATE_TEST_SUITE_P(Each, ArbiterAnnouncedTest, testing::Values("83 05"_hex, "83 06"_hex));

TEST_P(ArbiterAnnouncedTest, P5APanelThatOftenSaysSoAndNothingMoreIsNotWaitedFor) {
    know();
    for (unsigned i = 0; i < 4; ++i) {
        ask(100 + i);
        answer(script, 17, GetParam(), 12ms);
        script.run_for(2s);
    }
    ask(110);
    answer(script, 17, GetParam(), 12ms);
    ask(111);
    EXPECT_EQ(script.sent.back().adu, encode_adu(17, read_at(111)));
}

/// A gateway before the panel says 0B after 200 ms, and the reply follows.
class ArbiterFollowedRefusalTest : public ArbiterAnswersTest {
  protected:
    ArbiterFollowedRefusalTest() {
        know();
        ask(100);
        answer(script, 17, kRefusal, 200ms);
    }
    /// Nothing is asked for so long, though something waits.
    void expect_rest(Duration time) {
        const std::size_t sent = script.sent.size();
        script.run_for(time);
        EXPECT_EQ(script.sent.size(), sent);
    }

    const Bytes kRefusal = "83 0B"_hex;
};

TEST_F(ArbiterFollowedRefusalTest, P1ItsReplyAnswersNoLaterReadOnceThatWasSeen) {
    script.run_for(30ms);
    script.hear_reply(17, reply_number(100));
    for (const unsigned i : {200u, 210u, 220u, 230u, 240u}) {
        script.run_for(1s);
        ask(i);
        answer(script, 17, kRefusal, 200ms);
        const Ticket next = ask(i + 1);
        expect_rest(30ms);
        script.hear_reply(17, reply_number(i));
        answer_next(script, 17, reply_number(i + 1), 12ms);
        EXPECT_EQ(value(next), reply_number(i + 1));
    }
}

TEST_F(ArbiterFollowedRefusalTest, P5ItsGoodRepliesAreNotPausedForAndOthersRefusalsNotEither) {
    script.run_for(30ms);
    script.hear_reply(17, reply_number(100));
    for (unsigned i = 200; i < 210; ++i) {
        script.run_for(1s);
        const Ticket good = ask(i);
        answer(script, 17, i % 3 == 0 ? "83 02"_hex : reply_number(i), 12ms);
        EXPECT_TRUE(script.answered(good));
        const std::size_t sent = script.sent.size();
        ask(300 + i);
        EXPECT_GT(script.sent.size(), sent) << i;
        answer(script, 17, reply_number(300 + i), 12ms);
    }
}

TEST_F(ArbiterFollowedRefusalTest, P1ItIsSeenBehindTheNextReplyToo) {
    const Ticket next = ask(101);
    answer(script, 17, reply_number(100), 12ms);  // nobody can tell
    ASSERT_TRUE(script.answered(next));
    script.run_for(2ms);
    script.hear_reply(17, reply_number(101));
    script.run_for(1s);
    ask(200);
    answer(script, 17, kRefusal, 200ms);
    ask(201);
    expect_rest(30ms);
}

/// Function 17h reads what it has written, and more: it is not repeated.
class ArbiterReadWriteTest : public ArbiterAnswersTest {
  protected:
    ArbiterReadWriteTest() {
        know();
        exchange(1);
        answer(script, 17, kTen, 12ms);
        doubted_ = exchange(2);
        answer(script, 17, kTen, 12ms);  // of the one before?
        EXPECT_FALSE(script.answered(doubted_));
        read_ = script.next_sent(200ms);
    }
    /// Reads register `number`, writes register 9.
    Ticket exchange(std::uint8_t number) {
        Bytes pdu = "17 00 00 00 01 00 09 00 01 02 00 07"_hex;
        pdu[2] = number;
        script.run_for(20ms);
        return script.submit(17, pdu, 1);
    }

    const Bytes kTen = "17 02 00 0A"_hex;
    Ticket doubted_ = 0;
    std::optional<BusScript::Sent> read_;
};

TEST_F(ArbiterReadWriteTest, P1AnAnswerThatRepeatsAnothersIsGivenIfAReadSaysTheSame) {
    ASSERT_TRUE(read_);
    EXPECT_EQ(read_->adu, encode_adu(17, "03 00 02 00 01"_hex));
    answer(script, 17, "03 02 00 0A"_hex, 12ms);
    EXPECT_EQ(value(doubted_), kTen);
}

TEST_F(ArbiterReadWriteTest, P1ItHasNoAnswerIfTheReadDiffers) {
    ASSERT_TRUE(read_);
    answer(script, 17, "03 02 00 0B"_hex, 12ms);
    EXPECT_EQ(script.answer(doubted_).pdu.error(), Fault::timeout);
    const auto is_exchange = [](const auto& one) { return one.adu[1] == 0x17; };
    EXPECT_EQ(std::ranges::count_if(script.sent, is_exchange), 2) << "P2: not repeated";
}

TEST_F(ArbiterReadWriteTest, P5ItIsGivenWhereNoReadCanTell) {
    answer(script, 17, "83 01"_hex, 12ms);
    EXPECT_EQ(value(doubted_), kTen);
}

TEST_F(ArbiterReadWriteTest, P5EqualValuesAreBelievedOnceReadsHaveSaidTheSameThreeTimes) {
    answer(script, 17, "03 02 00 0A"_hex, 12ms);
    for (std::uint8_t i = 3; i < 5; ++i) {
        const Ticket ticket = exchange(i);
        answer(script, 17, kTen, 12ms);
        while (!script.answered(ticket)) answer_next(script, 17, "03 02 00 0A"_hex, 12ms);
        EXPECT_EQ(value(ticket), kTen);
    }
    const Ticket next = exchange(6);
    answer(script, 17, kTen, 12ms);
    EXPECT_EQ(value(next), kTen);
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_refusals_test
