// Frames that answer no open request: of other stations (T5), of other masters (T9), answers to
// broadcasts (T11), copies (T12), second panels and other wrong frames (T13).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::unasked_test {
namespace {

using modbus::encode_adu;

const Bytes kElsewhere = "10 00 68 00 02 04 00 0B 00 00"_hex;

class UnaskedTest : public ArbiterTest {
  protected:
    UnaskedTest() {
        for (StationSettings& station : settings.stations) station.retries = 0;
        bus.apply(settings);
    }
    void read(unsigned number = 1, std::uint8_t station = 17) {
        const Ticket ticket = bus.submit(station, read_at(number));
        answer(bus, station, reply_number(number), 3ms);
        EXPECT_TRUE(bus.answered(ticket));
        bus.run_for(100ms);
    }
    /// These bytes are heard while nothing is asked.
    void hear(const Bytes& bytes) {
        bus.hear(bytes);
        bus.run_for(100ms);
    }
    FrameKind last_kind() const { return bus.notes.back().kind; }
    const Symptoms& symptoms(std::uint8_t station = 17) { return counters(station).symptoms; }
};

TEST_F(UnaskedTest, P1T5AGoodFrameOfAnotherStationIsCountedAndMovesNoDeadline) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    const TimePoint sent = bus.now();
    bus.run_for(400ms);
    bus.hear_reply(18, kReply);
    EXPECT_FALSE(bus.answered(ticket));
    expect_answer_at(bus, ticket, sent + kSilence);
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    EXPECT_EQ(counters().foreign_frames, 1u);
    EXPECT_EQ(counters(18).symptoms.unasked + counters(0).symptoms.unasked, 1u);
}

TEST_F(UnaskedTest, MST04WhatComesWhileNobodyWasAskedIsCountedAndStartsTheGapAnew) {
    bus.hear_reply(17, kReply);
    const TimePoint heard = bus.now();
    const Ticket ticket = bus.submit(17, kRead);
    EXPECT_EQ(bus.next_sent().value().at, heard + gap);
    EXPECT_FALSE(bus.answered(ticket));
    EXPECT_EQ(last_kind(), FrameKind::request);
    EXPECT_EQ(bus.notes[0].kind, FrameKind::foreign);
}

// Another master (T9)

TEST_F(UnaskedTest, P1T9BehindAnotherMastersRequestTheLineIsLeftToItsPanel) {
    for (const Duration think : {3ms, 25ms}) {
        BusScript line{settings};
        line.submit(17, kRead);
        answer(line, 17, kReply, think);
        line.run_for(100ms);
        line.hear(encode_adu(30, kRead));
        const TimePoint heard = line.now();
        line.submit(17, read_at(5));
        const Duration left = line.next_sent().value().at - heard;
        EXPECT_GE(left, std::max<Duration>(3 * think, timing::kShortestForeign));
        EXPECT_LE(left, 130ms);
    }
}

TEST_F(UnaskedTest, P5T9ForNoLongerThanUntilItsReplyWasHeard) {
    read();
    bus.hear(encode_adu(30, kRead));
    bus.submit(17, read_at(5));
    bus.run_for(8ms);
    bus.hear(encode_adu(30, kReply));
    EXPECT_LE(bus.next_sent().value().at - bus.now(), 30ms);
    EXPECT_EQ(symptoms().requests, 1u);
    BusScript line{settings};
    line.hear(Writer().raw(encode_adu(30, kRead)).raw(encode_adu(30, kReply)).take());
    line.run_for(25ms);
    const TimePoint asked = line.now();
    line.submit(17, kRead);
    EXPECT_EQ(line.sent.back().at, asked) << "its reply was heard as well";
}

TEST_F(UnaskedTest, P1T9AReplyThatMayBeItsPanelsIsDamageAndNoValue) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear(encode_adu(17, "03 00 00 00 03"_hex));
    bus.hear_reply(17, kReply);
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_for(2s);
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::damaged);
    const Ticket next = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear(encode_adu(17, "03 00 00 00 01"_hex));
    bus.hear_reply(17, "03 02 00 07"_hex);
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(next).pdu.value(), kReply) << "another length";
}

TEST_F(UnaskedTest, P1T9ItsWriteOfTheSameItemsConfirmsNoneOfOurs) {
    read();
    bus.hear(encode_adu(17, kToAll));
    bus.run_for(60ms);
    const Ticket ticket = bus.submit(17, kToOne);
    bus.run_to_end_of_request();
    bus.hear_reply(17, kConfirmed);
    EXPECT_FALSE(bus.answered(ticket)) << "perhaps said to the other master";
    bus.run_for(kSilence);
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::damaged);
}

// Broadcasts (T11)

TEST_F(UnaskedTest, P8T11AnAnswerToABroadcastConfirmsNoWrite) {
    read();
    bus.submit(0, kToAll, 1, PriorityClass::write);
    bus.run_to_end_of_request();
    const TimePoint left = bus.now();
    const Ticket same = bus.submit(17, kToOne, 2, PriorityClass::write);
    ASSERT_EQ(bus.next_sent().value().kind, FrameKind::probe);
    EXPECT_EQ(bus.sent.back().at, left + settings.broadcast_turnaround);
    bus.run_to_end_of_request();
    bus.hear_reply(17, kConfirmed);
    EXPECT_EQ(last_kind(), FrameKind::foreign);
    EXPECT_EQ(symptoms().broadcast_replies, 1u);
    bus.run_for(3ms);
    bus.hear_reply(17, kReply);  // of the proof
    ASSERT_EQ(bus.next_sent().value().adu, encode_adu(17, kToOne));
    EXPECT_FALSE(bus.answered(same));
    answer(bus, 17, kConfirmed, 3ms);
    EXPECT_TRUE(bus.answer(same).pdu);
}

TEST_F(UnaskedTest, P5T11AWriteThatNoAnswerToABroadcastCouldConfirmGoesAtTheTurnaround) {
    read();
    for (const std::uint8_t station : Bytes{17, 0}) {
        bus.submit(0, kToAll, 1, PriorityClass::write);
        bus.run_to_end_of_request();
        const TimePoint left = bus.now();
        bus.submit(station, station == 17 ? kElsewhere : kToOne, 2, PriorityClass::write);
        EXPECT_EQ(bus.next_sent().value().at, left + settings.broadcast_turnaround);
        EXPECT_EQ(bus.sent.back().adu[0], station);
        bus.run_for(2s);
    }
}

TEST_F(UnaskedTest, T11WhatComesInTheTurnaroundIsCountedAndGivenToNobody) {
    read();
    const Ticket broadcast = bus.submit(0, kToAll);
    const Ticket next = bus.submit(17, kRead, 2);
    answer(bus, 17, kConfirmed, 10ms);
    EXPECT_TRUE(bus.answered(broadcast));
    EXPECT_FALSE(bus.answered(next));
    answer_next(bus, 17, kReply, 3ms);
    EXPECT_EQ(bus.answer(next).pdu.value(), kReply);
    EXPECT_EQ(symptoms().broadcast_replies, 1u);
    EXPECT_EQ(symptoms().wrong, 0u);
}

// Copies (T12)

TEST_F(UnaskedTest, T12ACopyThatComesWhileNothingIsAskedMakesTheLineRestBehindTheStationsReplies) {
    bus.submit(17, read_at(1));
    answer(bus, 17, reply_number(1), 3ms);
    bus.run_for(40ms);
    hear(encode_adu(17, reply_number(1)));
    EXPECT_EQ(last_kind(), FrameKind::copy);
    EXPECT_EQ(symptoms().doubled, 1u);
    bus.submit(17, read_at(2));
    answer(bus, 17, reply_number(2), 3ms);
    EXPECT_EQ(bus.events.back().kind, StationEvent::Kind::trail);
    const TimePoint replied = bus.now();
    bus.submit(18, read_at(3), 2);
    EXPECT_EQ(bus.next_sent().value().at, replied + 50ms) << "a quarter longer than the copy took";
    answer(bus, 18, reply_number(3), 3ms);
    bus.submit(18, read_at(4), 2);
    EXPECT_LE(bus.next_sent().value().at - bus.now(), gap) << "18 sends no copies";
}

TEST_F(UnaskedTest, P1T12NothingIsLearnedFromAFrameThatMayAnswerWhatIsAsked) {
    bus.submit(17, read_at(1));
    answer(bus, 17, reply_number(1), 3ms);
    const Ticket next = bus.submit(17, read_at(2));
    answer_next(bus, 17, reply_number(1), 20ms);  // equal values
    EXPECT_EQ(bus.answer(next).pdu.value(), reply_number(1));
    EXPECT_EQ(symptoms().doubled, 0u);
    const TimePoint replied = bus.now();
    bus.submit(17, read_at(3));
    EXPECT_EQ(bus.next_sent().value().at, replied + gap);
}

// A second panel, and other wrong frames (T13)

TEST_F(UnaskedTest, P1T13AFrameThatDoesNotFitIsWrongAndEndsTheAttempt) {
    for (const Bytes& pdu : {"03 0A 00 01 00 02 00 03 00 04 00 05"_hex, "03 02 00 01"_hex}) {
        const Ticket ticket = bus.submit(17, kRead);
        answer(bus, 17, pdu, 3ms);
        bus.run_for(25ms);
        EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::wrong);
        bus.run_for(2s);
    }
    EXPECT_EQ(symptoms().wrong, 2u);
    EXPECT_FALSE(bus.arbiter().health(17).offline()) << "no silence";
}

TEST_F(UnaskedTest, P1T13AnExceptionOfAnotherFunctionIsCountedAndTheReplyAwaited) {
    const Ticket ticket = bus.submit(17, kRead);
    answer(bus, 17, "84 02"_hex, 3ms);
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_for(20ms);
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    const Ticket refused = bus.submit(17, kRead);
    answer_next(bus, 17, "84 02"_hex, 3ms);
    bus.run_for(2s);
    EXPECT_EQ(bus.answer(refused).pdu.error(), Fault::wrong);
    EXPECT_EQ(symptoms().wrong_exceptions, 1u);
}

TEST_F(UnaskedTest, T13AnotherAnswerSoonBehindTheReplyIsASecondPanels) {
    read(1);
    hear(encode_adu(17, reply_number(9)));
    EXPECT_EQ(symptoms().doubled, 1u);
    EXPECT_EQ(last_kind(), FrameKind::foreign);
    bus.run_for(timing::kSecondPanel);
    hear(encode_adu(17, reply_number(9)));
    EXPECT_EQ(symptoms().doubled, 1u);
    EXPECT_EQ(symptoms().unasked, 1u);
}

TEST_F(UnaskedTest, P1T13OfTwoAnswersInOnePieceTheFirstIsTaken) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear(Writer().raw(encode_adu(17, kReply)).raw(encode_adu(17, reply_number(9))).take());
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    bus.run_for(100ms);
    EXPECT_EQ(symptoms().doubled, 1u) << "the finding `duplicate-address` tells";
}

TEST_F(UnaskedTest, T3AFrameThatOurRequestCutsInTwoHidesNoReply) {
    read();
    const Bytes foreign = encode_adu(18, "03 02 00 07"_hex);
    bus.hear(ByteView(foreign).first(4));
    bus.run_for(60ms);
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear(ByteView(foreign).subspan(4));
    bus.run_for(5ms);
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
}

}  // namespace
}  // namespace panelgate::arbiter::unasked_test
