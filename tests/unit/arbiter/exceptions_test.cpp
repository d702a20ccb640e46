// Exceptions are final (T10), and nothing is too early (T7).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::exceptions_test {
namespace {

using modbus::encode_adu;

Bytes exception(unsigned function, unsigned code) {
    return Writer().u8(0x80 + function).u8(code).take();
}

class ExceptionTest : public ArbiterTest, public testing::WithParamInterface<unsigned> {};

TEST_P(ExceptionTest, P1IsPassedOnUnchangedAndAtOnceAndItsRequestNeverSentAgain) {
    for (const Bytes& pdu : {kRead, kWrite, "14 07 06 00 04 00 01 00 02"_hex, "41 01"_hex}) {
        BusScript line{settings};
        const Bytes told = exception(pdu[0], GetParam());
        const Ticket asked = line.submit(17, pdu);
        line.run_to_end_of_request();
        line.run_for(1ms);
        line.hear_reply(17, told);
        if (pdu[0] == 0x41) line.run_for(20ms);
        ASSERT_TRUE(line.answered(asked)) << to_hex(pdu);
        EXPECT_EQ(line.answer(asked).pdu.value(), told);
        line.run_for(5s);
        EXPECT_EQ(line.sent.size(), 1u);
    }
}

TEST_P(ExceptionTest, P1BehindAnOutstandingRequestOfAnotherFunctionItIsItsOwnRequests) {
    settings.stations[0].retries = 0;
    BusScript line{settings};
    line.submit(17, kWrite);
    line.run_for(600ms);
    const Ticket asked = line.submit(17, kRead);
    answer(line, 17, exception(3, GetParam()), 3ms);
    ASSERT_TRUE(line.answered(asked)) << "at once";
    EXPECT_EQ(line.answer(asked).pdu.value(), exception(3, GetParam()));
    EXPECT_EQ(line.sent.size(), 2u);
}

INSTANTIATE_TEST_SUITE_P(Each, ExceptionTest,
                         testing::Values(0x01u, 0x02u, 0x04u, 0x05u, 0x06u, 0x08u, 0x0Au, 0x0Bu));

/// 05 (acknowledge) and 06 (busy): the real reply may follow.
class AnnouncedTest : public ArbiterTest, public testing::WithParamInterface<unsigned> {
  protected:
    AnnouncedTest() {
        for (const Bytes& pdu : {kRead, "03 00 6B 00 02"_hex}) {
            bus.submit(17, pdu);
            answer(bus, 17, pdu == kRead ? kReply : "03 04 00 01 00 02"_hex, 3ms);
            bus.run_for(10ms);
        }
        bus.submit(17, read_at(1));
        answer(bus, 17, exception(3, GetParam()), 3ms);
    }
};

TEST_P(AnnouncedTest, P1TheReplyThatFollowsAnswersNoLaterRead) {
    const Ticket next = bus.submit(17, read_at(2));
    EXPECT_EQ(bus.next_sent(10ms).value().kind, FrameKind::probe);
    bus.run_to_end_of_request();
    bus.hear_reply(17, reply_number(1));
    EXPECT_FALSE(bus.answered(next));
    EXPECT_EQ(bus.notes.back().kind, FrameKind::late);
    bus.run_for(3ms);
    bus.hear_reply(17, "03 04 00 01 00 02"_hex);
    ASSERT_EQ(bus.next_sent(10ms).value().adu, encode_adu(17, read_at(2)));
    answer(bus, 17, reply_number(2), 3ms);
    EXPECT_EQ(bus.answer(next).pdu.value(), reply_number(2));
}

INSTANTIATE_TEST_SUITE_P(Each, AnnouncedTest, testing::Values(0x05u, 0x06u));

TEST_F(ArbiterTest, P1AnExceptionBehindAnOutstandingReadIsTheOlderOnesAndTheProofsOwnFollows) {
    settings.stations[0].retries = 0;
    BusScript line{settings};
    line.submit(17, "03 00 6B 00 02"_hex);
    answer(line, 17, "03 04 00 01 00 02"_hex, 3ms);
    line.run_for(10ms);
    line.submit(17, read_at(1));
    line.run_for(600ms);
    const Ticket next = line.submit(17, read_at(2));
    ASSERT_EQ(line.sent.back().kind, FrameKind::probe);
    answer(line, 17, "83 02"_hex, 3ms);  // of the outstanding read
    line.run_for(3ms);
    line.hear_reply(17, "83 04"_hex);  // of the proof
    ASSERT_EQ(line.next_sent(10ms).value().adu, encode_adu(17, read_at(2)));
    answer(line, 17, "83 02"_hex, 3ms);
    EXPECT_EQ(line.answer(next).pdu.value(), "83 02"_hex);
}

// T7

TEST_F(ArbiterTest, P1AReplyThatComesWhileItsRequestIsStillLeavingIsTaken) {
    for (const bool paced : {false, true}) {
        settings.paced = paced;
        BusScript line{settings};
        for (const Bytes& pdu : {kRead, kWrite, "10 00 01 00 01 02 00 03"_hex}) {
            const Ticket asked = line.submit(17, pdu);
            const Bytes reply = pdu == kRead    ? kReply
                                : pdu == kWrite ? kWrite
                                                : "10 00 01 00 01"_hex;
            line.run_for(50us);
            line.hear_reply(17, reply);
            ASSERT_TRUE(line.answered(asked)) << to_hex(pdu);
            EXPECT_EQ(line.answer(asked).pdu.value(), reply);
            line.run_for(20ms);
        }
        EXPECT_EQ(line.sent.size(), 3u);
    }
}

TEST_F(ArbiterTest, P1EqualValuesAndEqualRefusalsAreNoSignOfAnything) {
    for (unsigned i = 0; i < 20; ++i) {
        const Ticket asked = bus.submit(17, read_at(i));
        const Bytes zeros = i % 3 == 2 ? "83 02"_hex : "03 06 00 00 00 00 00 00"_hex;
        answer(bus, 17, zeros, 3ms);
        ASSERT_TRUE(bus.answered(asked)) << i;
        EXPECT_EQ(bus.answer(asked).pdu.value(), zeros);
        bus.run_for(50ms);
    }
    EXPECT_EQ(bus.sent.size(), 20u);
    EXPECT_EQ(counters().symptoms.doubled, 0u);
}

}  // namespace
}  // namespace panelgate::arbiter::exceptions_test
