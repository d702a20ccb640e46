// A line in ASCII mode: the same promises.
#include <gtest/gtest.h>

#include <cctype>
#include <string>
#include <string_view>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::ascii_test {
namespace {

Bytes text(std::string_view characters) { return Bytes(characters.begin(), characters.end()); }
const Bytes kReplyText = modbus::encode_ascii(17, kReply);

Settings ascii_settings() {
    Settings settings = settings_38400();
    settings.serial = {9600, 7, Parity::even, 1, SerialMode::ascii};
    settings.reply_hole = 1s;
    return settings;
}

class AsciiLine : public testing::Test {
  protected:
    Settings settings = ascii_settings();
    BusScript bus{settings};
    Duration gap = silent_interval(settings.serial);

    const StationCounters& counters() { return bus.arbiter().station_counters().at(17); }
    Ticket ask(const Bytes& pdu = kRead) {
        const Ticket ticket = bus.submit(17, pdu);
        bus.run_to_end_of_request();
        bus.run_for(2ms);
        return ticket;
    }
};

TEST_F(AsciiLine, HandsTheReplyOnAtItsLastCharacter) {
    const Ticket ticket = bus.submit(17, kRead);
    ASSERT_EQ(bus.sent.size(), 1u);
    EXPECT_EQ(bus.sent[0].adu, text(":1103006B00037E\r\n"));
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    bus.hear_paced(ByteView(kReplyText).first(kReplyText.size() - 1));
    EXPECT_FALSE(bus.answered(ticket));
    bus.hear_paced(ByteView(kReplyText).last(1));
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(bus.answer(ticket).at, bus.now());
}

TEST_F(AsciiLine, SendsTheNextRequestBehindAShortTurnaround) {
    bus.submit(17, kRead, 1);
    bus.submit(18, kRead, 2);
    bus.run_to_end_of_request();
    bus.run_for(2ms);
    bus.hear_reply(17, kReply);
    const TimePoint last = bus.now();
    const auto next = bus.next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->adu[2], '2');
    EXPECT_EQ(next->at - last, gap);
    EXPECT_LT(gap, 3 * character_time(settings.serial));
}

TEST_F(AsciiLine, CountsTheTimeoutFromTheEndOfItsLongerRequest) {
    settings.stations[0].retries = 0;
    BusScript script{settings};
    const Ticket ticket = script.submit(17, kRead);
    const TimePoint end = script.now() + wire_time(settings.serial, 17);
    script.run_until(end + 500ms - 1us);
    EXPECT_FALSE(script.answered(ticket));
    script.run_until(end + 500ms);
    ASSERT_TRUE(script.answered(ticket));
    EXPECT_EQ(script.answer(ticket).pdu.error(), Fault::timeout);
}

TEST_F(AsciiLine, CountsDamageThatIsLowerCase) {
    Bytes lower = modbus::encode_ascii(17, "03 06 02 2B 00 00 00 AE"_hex);
    for (std::uint8_t& c : lower) c = static_cast<std::uint8_t>(std::tolower(c));
    ask();
    bus.hear_paced(lower);
    bus.run_for(20ms);
    EXPECT_EQ(counters().symptoms.damaged(), 1u);
    EXPECT_EQ(counters().symptoms.lower_case, 1u);
}

TEST_F(AsciiLine, AWrongLrcIsDamageAndTheReadGoesAgainAtOnce) {
    const Ticket ticket = ask();
    Bytes bad = kReplyText;
    bad[bad.size() - 3] ^= 1;
    bus.hear(bad);
    EXPECT_FALSE(bus.answered(ticket));
    const TimePoint heard = bus.now();
    const auto again = bus.next_sent();
    ASSERT_TRUE(again);
    EXPECT_LT(again->at - heard, 5ms);
    EXPECT_EQ(counters().damaged_frames, 1u);
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
}

TEST_F(AsciiLine, P1ALateReplyAnswersNoRequestAndEndsTheRest) {
    settings.stations[0].retries = 0;
    BusScript script{settings};
    const Ticket first = script.submit(17, read_at(1), 1);
    const Ticket second = script.submit(17, read_at(2), 2);
    while (!script.answered(first)) script.run_for(1ms);
    script.run_for(300ms);
    script.hear_reply(17, kReply);  // of the first: same station, function and length
    script.run_for(100ms);
    EXPECT_FALSE(script.answered(second));
    ASSERT_EQ(script.events.size(), 1u);
    EXPECT_EQ(script.events[0].kind, StationEvent::Kind::late);
    ASSERT_EQ(script.sent.size(), 2u);
    script.hear_reply(17, reply_number(2));
    EXPECT_EQ(script.answer(second).pdu.value(), reply_number(2));
}

TEST_F(AsciiLine, APauseOfASecondInsideTheReplyIsWaitedFor) {
    const Ticket ticket = ask();
    bus.hear(ByteView(kReplyText).first(9));
    bus.run_for(990ms);
    EXPECT_FALSE(bus.answered(ticket));
    bus.hear(ByteView(kReplyText).subspan(9));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
}

TEST_F(AsciiLine, P1WhatComesAfterALongerPauseIsNoReply) {
    settings.stations[0].retries = 0;
    BusScript script{settings};
    const Ticket ticket = script.submit(17, kRead);
    script.run_to_end_of_request();
    script.hear(ByteView(kReplyText).first(9));
    script.run_for(1001ms);
    ASSERT_TRUE(script.answered(ticket));
    EXPECT_EQ(script.answer(ticket).pdu.error(), Fault::damaged);
    const Ticket other = script.submit(17, read_at(7));
    script.hear(ByteView(kReplyText).subspan(9));
    EXPECT_FALSE(script.answered(other));
}

TEST_F(AsciiLine, StepsOverWhatStandsInFrontOfTheReply) {
    for (const std::string_view front :
         {"\r\n", "noise", "x:11", ":1103", ":11830A62\r", ":2203062A\r\n", ":::"}) {
        const Ticket ticket = ask();
        bus.hear(text(front));
        bus.hear_reply(17, kReply);
        ASSERT_TRUE(bus.answered(ticket)) << front;
        EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply) << front;
        bus.run_for(1s);
    }
}

TEST_F(AsciiLine, AGoodFrameOfAnotherStationIsForeignAndTheReplyBehindItCounts) {
    const Ticket ticket = ask();
    bus.hear_reply(18, kReply);
    EXPECT_FALSE(bus.answered(ticket));
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(counters().foreign_frames, 1u);
}

TEST_F(AsciiLine, P1AReplyOfAnotherLengthIsNone) {
    const Ticket ticket = ask();
    bus.hear_reply(17, "03 04 02 2B 00 00"_hex);
    EXPECT_FALSE(bus.answered(ticket) && bus.answer(ticket).pdu.has_value());
    // A byte of 00 that was lost leaves the LRC right.
    bus.hear_reply(17, "03 06 02 2B 00 00 64"_hex);
    EXPECT_FALSE(bus.answered(ticket) && bus.answer(ticket).pdu.has_value());
}

TEST_F(AsciiLine, P1AFrameOfRtuIsNoReply) {
    const Ticket ticket = ask();
    bus.hear(modbus::encode_adu(17, kReply));
    bus.run_for(5s);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_FALSE(bus.answer(ticket).pdu.has_value());
}

TEST_F(AsciiLine, P1AReplyInsideAnotherFrameIsNone) {
    Bytes data = "03 0B"_hex;
    const Bytes inner = modbus::encode_adu(17, kReply);
    data.insert(data.end(), inner.begin(), inner.end());
    const Ticket ticket = ask();
    bus.hear_reply(18, data);
    EXPECT_FALSE(bus.answered(ticket));
}

TEST_F(AsciiLine, TheEchoIsTakenOut) {
    settings.echo = EchoMode::automatic;
    BusScript script{settings};
    for (unsigned i = 0; i < 3; ++i) {
        const Ticket ticket = script.submit(17, read_at(i));
        script.run_to_end_of_request();
        script.hear(script.sent.back().adu);
        EXPECT_FALSE(script.answered(ticket));
        script.run_for(3ms);
        script.hear_reply(17, reply_number(i));
        ASSERT_TRUE(script.answered(ticket));
        EXPECT_EQ(script.answer(ticket).pdu.value(), reply_number(i));
        script.run_for(10ms);
    }
    EXPECT_EQ(script.arbiter().echo(), EchoState::present);
    const Ticket write = script.submit(17, kWrite);
    script.run_to_end_of_request();
    script.hear(script.sent.back().adu);
    EXPECT_FALSE(script.answered(write)) << "the echo of 06 confirms nothing";
    script.hear_reply(17, kWrite);
    EXPECT_TRUE(script.answered(write));
}

TEST_F(AsciiLine, ADamagedEchoIsACollision) {
    settings.echo = EchoMode::on;
    settings.stations[0].retries = 0;
    BusScript script{settings};
    const Ticket ticket = script.submit(17, kRead);
    script.run_to_end_of_request();
    Bytes bad = script.sent.back().adu;
    bad[7] ^= 1;
    script.hear(bad);
    script.run_for(1s);
    EXPECT_EQ(script.answer(ticket).pdu.error(), Fault::damaged);
    EXPECT_EQ(script.arbiter().station_counters().at(17).echo_mismatches, 1u);
}

TEST_F(AsciiLine, LowerCaseIsTakenOnlyWhereConfigured) {
    Bytes lower = kReplyText;
    for (std::uint8_t& c : lower) c = static_cast<std::uint8_t>(c >= 'A' && c <= 'F' ? c + 32 : c);
    ASSERT_NE(lower, kReplyText);
    const Ticket refused = ask();
    bus.hear(lower);
    EXPECT_FALSE(bus.answered(refused));
    settings.ascii_digits = modbus::HexDigits::any_case;
    BusScript script{settings};
    const Ticket taken = script.submit(17, kRead);
    script.run_to_end_of_request();
    script.hear(lower);
    EXPECT_EQ(script.answer(taken).pdu.value(), kReply);
}

TEST_F(AsciiLine, NothingIsSentIntoAFrameThatHasBegun) {
    bus.hear(text(":"));
    const TimePoint begun = bus.now();
    bus.submit(17, kRead);
    EXPECT_TRUE(bus.sent.empty());
    bus.run_for(10ms);
    EXPECT_TRUE(bus.sent.empty());
    bus.hear(text("1283"));
    bus.run_for(10ms);
    EXPECT_TRUE(bus.sent.empty());
    bus.hear(text("0269\r\n"));
    const auto sent = bus.next_sent();
    ASSERT_TRUE(sent);
    EXPECT_LT(sent->at - begun, 30ms);
}

TEST_F(AsciiLine, ASingleColonBlocksTheLineOnlyBriefly) {
    bus.hear(text(":"));
    bus.submit(17, kRead);
    const TimePoint begun = bus.now();
    const auto sent = bus.next_sent();
    ASSERT_TRUE(sent);
    EXPECT_LE(sent->at - begun, 25ms);
}

TEST_F(AsciiLine, ARefusalIsHandedOnAndOneOfAnotherFunctionEndsTheAttempt) {
    const Ticket refused = ask();
    bus.hear_reply(17, "83 02"_hex);
    EXPECT_EQ(bus.answer(refused).pdu.value(), "83 02"_hex);
    const Ticket other = ask(read_at(3));
    bus.hear_reply(17, "90 02"_hex);
    const TimePoint heard = bus.now();
    const auto again = bus.next_sent();
    ASSERT_TRUE(again);
    EXPECT_LT(again->at - heard, 1s);
    EXPECT_FALSE(bus.answered(other));
}

TEST_F(AsciiLine, AReplyOfUnknownLengthNeedsNoSilence) {
    const Ticket ticket = ask("41 01"_hex);
    bus.hear_reply(17, "41 01 02 03 04"_hex);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), "41 01 02 03 04"_hex);
    EXPECT_EQ(bus.answer(ticket).at, bus.now());
}

TEST_F(AsciiLine, TheTraceHasTheFramesInRtuForm) {
    ask();
    bus.hear_reply(17, kReply);
    ASSERT_EQ(bus.notes.size(), 2u);
    EXPECT_EQ(bus.notes[0].bytes, modbus::encode_adu(17, kRead));
    EXPECT_EQ(bus.notes[1].bytes, modbus::encode_adu(17, kReply));
}

}  // namespace
}  // namespace panelgate::arbiter::ascii_test
