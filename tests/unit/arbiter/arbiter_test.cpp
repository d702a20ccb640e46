// One transaction: when it starts, what it hears, how it ends.
#include <gtest/gtest.h>

#include <vector>

#include "arbiter_fixture.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::arbiter_test {
namespace {

TEST_F(ArbiterTest, HandsTheReplyOnAtItsLastByte) {
    const Ticket ticket = bus.submit(17, kRead);
    ASSERT_EQ(bus.sent.size(), 1u);
    EXPECT_EQ(bus.sent[0].adu, "11 03 00 6B 00 03 76 87"_hex);
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    const Bytes adu = modbus::encode_adu(17, kReply);
    bus.hear_paced(ByteView(adu).first(adu.size() - 1));
    EXPECT_FALSE(bus.answered(ticket));
    bus.hear_paced(ByteView(adu).last(1));
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(bus.answer(ticket).at, bus.now());
}

TEST_F(ArbiterTest, SendsTheNextRequestExactlyAtTheGap) {
    bus.submit(17, kRead, 1);
    bus.submit(18, kRead, 2);
    bus.run_to_end_of_request();
    bus.run_for(2ms);
    bus.hear_reply(17, kReply);
    const TimePoint last_byte = bus.now();
    const auto next = bus.next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->adu[0], 18);
    EXPECT_EQ(next->at - last_byte, gap);
}

TEST_F(ArbiterTest, CountsTheTimeoutFromTheEndOfTheRequestOnTheWire) {
    settings.unlisted.retries = 0;
    settings.stations.clear();
    BusScript script{settings};
    const Ticket ticket = script.submit(17, kRead);
    const TimePoint end = script.now() + wire_time(settings.serial, 8);
    script.run_until(end + 500ms - 1us);
    EXPECT_FALSE(script.answered(ticket));
    script.run_until(end + 500ms);
    ASSERT_TRUE(script.answered(ticket));
    EXPECT_EQ(script.answer(ticket).pdu.error(), Fault::timeout);
    EXPECT_TRUE(script.answer(ticket).transmitted);
}

TEST_F(ArbiterTest, GivesUpASilentStationAfterTimeoutTimesRetriesPlusOne) {
    const Ticket ticket = bus.submit(17, kRead);
    const TimePoint start = bus.now();
    bus.run_for(5s);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    EXPECT_EQ(bus.sent.size(), 2u);
    EXPECT_EQ(bus.answer(ticket).at - start, 2 * (500ms + wire_time(settings.serial, 8)));
    EXPECT_EQ(bus.arbiter().station_counters().at(17).retries, 1u);
}

TEST_F(ArbiterTest, ALineWithoutARealPaceIsLearned) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.hear_reply(17, kReply);  // a pty answers before the computed end of the request
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
}

TEST_F(ArbiterTest, P5OnALineThatIsQuickerThanItsRateTheGapFollowsTheReply) {
    for (unsigned i = 0; i < 6; ++i) bus.submit(17, read_at(i));
    std::vector<TimePoint> replied;
    for (std::size_t i = 0; i < 6; ++i) {
        ASSERT_EQ(bus.sent.size(), i + 1);
        bus.run_for(100us);
        bus.hear_reply(17, reply_number(i));
        replied.push_back(bus.now());
        bus.next_sent();
    }
    const Duration leaving = wire_time(settings.serial, 8);
    EXPECT_EQ(bus.sent[1].at, bus.sent[0].at + leaving + gap) << "one may have been a late one";
    EXPECT_EQ(bus.sent[4].at, replied[3] + gap);
    EXPECT_EQ(bus.sent[5].at, replied[4] + gap);
}

TEST_F(ArbiterTest, AForeignFrameIsSteppedOverAndDoesNotExtendTheDeadline) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.run_for(5ms);
    bus.hear_reply(18, kReply);
    bus.run_for(40ms);
    EXPECT_FALSE(bus.answered(ticket));
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).foreign_frames, 1u);
}

TEST_F(ArbiterTest, P1AReplyOfAnotherLengthIsNotTaken) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear_reply(17, "03 0A 00 01 00 02 00 03 00 04 00 05"_hex);
    EXPECT_FALSE(bus.answered(ticket));
    ASSERT_TRUE(bus.next_sent(2 * gap)) << "it said something else: nobody waits any longer";
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).foreign_frames, 1u);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).late_frames, 0u);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).symptoms.wrong, 1u);
}

TEST_F(ArbiterTest, ADamagedReplyIsRetriedAfterSilenceAndCounted) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    Bytes adu = modbus::encode_adu(17, kReply);
    adu[4] ^= 1;
    bus.hear(adu);
    const TimePoint damaged_at = bus.now();
    const auto again = bus.next_sent();
    ASSERT_TRUE(again);
    EXPECT_EQ(again->at - damaged_at, 20ms);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).damaged_frames, 1u);
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
}

TEST_F(ArbiterTest, OnlyDamagedRepliesEndAsDamaged) {
    const Ticket ticket = bus.submit(17, kRead);
    for (int i = 0; i < 2; ++i) {
        bus.run_to_end_of_request();
        bus.hear(ByteView(modbus::encode_adu(17, kReply)).first(6));
        bus.run_for(510ms);  // how long it needs is not known yet: the rest may come
    }
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::damaged);
    EXPECT_EQ(bus.arbiter().health(17).silent_in_a_row(), 0);
}

TEST_F(ArbiterTest, APanelsExceptionIsFinal) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear_reply(17, "83 06"_hex);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), "83 06"_hex);
    bus.run_for(5s);
    EXPECT_EQ(bus.sent.size(), 1u);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).exceptions.at(6), 1u);
}

TEST_F(ArbiterTest, AReplyThatHasBegunInTimeIsHeardToItsEnd) {
    settings.serial.baud = 1200;
    settings.unlisted.response_timeout = 1s;
    settings.stations.clear();
    settings.queue.deadline = 10s;
    BusScript script{settings};
    const Ticket ticket = script.submit(17, "03 00 00 00 7D"_hex);
    script.run_to_end_of_request();
    script.run_for(990ms);
    Bytes pdu{0x03, 250};
    pdu.resize(252, 0x5A);
    script.hear_paced(modbus::encode_adu(17, pdu));  // 2.1 s on the wire
    ASSERT_TRUE(script.answered(ticket));
    EXPECT_EQ(script.answer(ticket).pdu.value(), pdu);
}

TEST_F(ArbiterTest, PausesUpToTheEndOfFrameTimeInsideAReplyAreNoError) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    const Bytes adu = modbus::encode_adu(17, kReply);
    for (const std::uint8_t& b : adu) {
        bus.run_for(15ms);
        bus.hear(ByteView(&b, 1));
    }
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(bus.sent.size(), 1u);
}

TEST_F(ArbiterTest, AReplyWithoutAKnownLengthEndsWithSilence) {
    const Ticket ticket = bus.submit(17, "41 DE AD"_hex);
    bus.run_to_end_of_request();
    bus.hear("11 41 DE AD CD 11"_hex);  // a CRC that is right in mid-frame must not end it
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_for(1ms);
    bus.hear("00 11 22 33 08 B0"_hex);
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_for(20ms);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), "41 DE AD CD 11 00 11 22 33"_hex);
}

TEST_F(ArbiterTest, TheLongerGapOfAStationIsKept) {
    settings.stations[1].frame_gap = 40ms;
    BusScript script{settings};
    script.submit(17, read_at(1), 1);
    script.submit(18, kRead, 2);
    script.submit(17, read_at(2), 1);
    script.run_to_end_of_request();
    script.hear_reply(17, kReply);
    TimePoint last = script.now();
    EXPECT_EQ(script.next_sent()->at - last, 40ms);
    script.run_to_end_of_request();
    script.hear_reply(18, kReply);
    last = script.now();
    EXPECT_EQ(script.next_sent()->at - last, 40ms);
}

TEST_F(ArbiterTest, P7ALostLineAnswersEverythingAtOnce) {
    const Ticket on_wire = bus.submit(17, kRead, 1);
    const Ticket queued = bus.submit(17, kWrite, 2);
    bus.line_down();
    EXPECT_EQ(bus.answer(on_wire).pdu.error(), Fault::line_lost);
    EXPECT_TRUE(bus.answer(on_wire).transmitted);
    EXPECT_EQ(bus.answer(queued).pdu.error(), Fault::line_down);
    EXPECT_FALSE(bus.answer(queued).transmitted);
    EXPECT_EQ(bus.try_submit(17, kRead).error(), Fault::line_down);
    bus.line_up();
    bus.run_for(1100ms);
    EXPECT_EQ(bus.sent.size(), 1u) << "nothing is sent again after a lost line";
    bus.submit(17, kRead);
    EXPECT_EQ(bus.sent.size(), 2u);
}

TEST_F(ArbiterTest, UnaskedBytesPostponeTheNextRequest) {
    bus.hear("00 11 22"_hex);
    const TimePoint heard = bus.now();
    bus.submit(17, kRead);
    const auto sent = bus.next_sent();
    ASSERT_TRUE(sent);
    EXPECT_EQ(sent->at - heard, gap);
}

TEST_F(ArbiterTest, EarlyAndRepeatedDeadlineCallsAreHarmless) {
    const Ticket ticket = bus.submit(17, kRead);
    for (int i = 0; i < 1000; ++i) bus.arbiter().on_deadline(bus.now());
    EXPECT_EQ(bus.sent.size(), 1u);
    bus.run_for(5s);
    EXPECT_TRUE(bus.answered(ticket));
    EXPECT_TRUE(bus.arbiter().idle());
    EXPECT_FALSE(bus.arbiter().next_deadline());
}

TEST_F(ArbiterTest, EndlessNoiseEndsInATimeoutNotInAHang) {
    const Ticket ticket = bus.submit(17, kWrite);
    bus.run_to_end_of_request();
    const Bytes noise(64, 0xA5);
    for (int i = 0; i < 1000 && !bus.answered(ticket); ++i) {
        bus.hear(noise);
        bus.run_for(5ms);
    }
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_FALSE(bus.answer(ticket).pdu.has_value());
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_test
