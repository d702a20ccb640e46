// A line in ASCII mode: the same promises.
#include <gtest/gtest.h>

#include <cctype>
#include <cstdint>
#include <string_view>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::ascii_test {
namespace {

Bytes text(std::string_view characters) { return Bytes(characters.begin(), characters.end()); }
const Bytes kReplyText = modbus::encode_ascii(17, kReply);

/// The same digits in lower case.
Bytes lower(Bytes characters) {
    for (std::uint8_t& c : characters) c = static_cast<std::uint8_t>(std::tolower(c));
    return characters;
}

Settings ascii_settings() {
    Settings settings = settings_38400();
    settings.serial = {9600, 7, Parity::even, 1, SerialMode::ascii};
    settings.reply_hole = 1s;
    return settings;
}

class AsciiLine : public testing::Test {
  protected:
    const StationCounters& counters() { return bus.arbiter().station_counters().at(17); }
    Ticket ask(const Bytes& pdu = kRead) {
        const Ticket ticket = bus.submit(17, pdu);
        bus.run_to_end_of_request();
        bus.run_for(2ms);
        return ticket;
    }
    const Result<Bytes>& told(Ticket ticket) const { return bus.answer(ticket).pdu; }

    Settings settings = ascii_settings();
    BusScript bus{settings};
};

TEST_F(AsciiLine, HandsTheReplyOnAtItsLastCharacter) {
    const Ticket ticket = ask();
    EXPECT_EQ(bus.sent.at(0).adu, text(":1103006B00037E\r\n"));
    bus.hear_paced(ByteView(kReplyText).first(kReplyText.size() - 1));
    EXPECT_FALSE(bus.answered(ticket));
    bus.hear_paced(ByteView(kReplyText).last(1));
    EXPECT_EQ(told(ticket).value(), kReply);
    EXPECT_EQ(bus.answer(ticket).at, bus.now());
}

/// Of a pause the characters count, not the bytes.
TEST_F(AsciiLine, AReplyGoesOnWithEachCharacter) {
    for (const std::size_t front : {6u, 7u, 8u}) {
        settings.reply_hole = 100ms;
        BusScript script{settings};
        const Ticket ticket = script.submit(17, kRead);
        script.run_to_end_of_request();
        script.run_for(2ms);
        script.hear_paced(ByteView(kReplyText).first(front));
        script.run_for(90ms);
        script.hear_paced(ByteView(kReplyText).subspan(front, 1));
        script.run_for(90ms);
        script.hear_paced(ByteView(kReplyText).subspan(front + 1));
        EXPECT_EQ(script.answer(ticket).pdu.value(), kReply) << front;
    }
}

TEST_F(AsciiLine, LowerCaseIsTakenOnlyWhereConfiguredAndElseCountedAsThat) {
    const Bytes reply = "03 06 02 2B 00 00 00 AE"_hex;
    for (const bool taken : {false, true}) {
        if (taken) settings.ascii_digits = modbus::HexDigits::any_case;
        BusScript script{settings};
        const Ticket ticket = script.submit(17, kRead);
        script.run_to_end_of_request();
        script.run_for(2ms);
        script.hear_paced(lower(modbus::encode_ascii(17, reply)));
        ASSERT_EQ(script.answered(ticket), taken);
        if (taken) EXPECT_EQ(script.answer(ticket).pdu.value(), reply);
        script.run_for(20ms);
        const Symptoms& symptoms = script.arbiter().station_counters().at(17).symptoms;
        EXPECT_EQ(symptoms.damaged(), taken ? 0u : 1u);
        EXPECT_EQ(symptoms.lower_case, taken ? 0u : 1u);
    }
}

/// pymodbus#2942, eModbus#407; '>' of an ABL eMH1
TEST_F(AsciiLine, OtherDelimitersAreCountedAsThat) {
    const std::string whole(kReplyText.begin(), kReplyText.end());
    const std::string bare = whole.substr(0, whole.size() - 2);
    const std::string damaged = bare.substr(0, bare.size() - 1) + (bare.back() == '0' ? "1" : "0");
    const std::pair<std::string, unsigned> rows[] = {
        {bare + "\n", 1},    {bare + "\r", 1},           {bare + "\r\r\n", 1},
        {bare + " \r\n", 1}, {'>' + whole.substr(1), 1}, {damaged + "\r\n", 0},
        {damaged + "\n", 0},
    };
    for (const auto& [text, counted] : rows) {
        settings.stations[0].retries = 0;
        BusScript script{settings};
        const Ticket ticket = script.submit(17, kRead);
        script.run_to_end_of_request();
        script.run_for(2ms);
        script.hear_paced(Bytes(text.begin(), text.end()));
        script.run_for(2s);
        EXPECT_TRUE(script.answered(ticket)) << text;
        EXPECT_FALSE(script.answer(ticket).pdu) << text;
        const Symptoms& symptoms = script.arbiter().station_counters().at(17).symptoms;
        EXPECT_EQ(symptoms.damaged(), 1u) << text;
        EXPECT_EQ(symptoms.delimited, counted) << text;
    }
}

TEST_F(AsciiLine, AWrongLrcIsDamageAndTheReadGoesAgainAtOnce) {
    const Ticket ticket = ask();
    Bytes bad = kReplyText;
    bad[bad.size() - 3] ^= 1;
    bus.hear(bad);
    EXPECT_FALSE(bus.answered(ticket));
    const TimePoint heard = bus.now();
    EXPECT_LT(bus.next_sent().value().at - heard, 5ms);
    EXPECT_EQ(counters().damaged_frames, 1u);
    answer(bus, 17, kReply);
    EXPECT_EQ(told(ticket).value(), kReply);
}

TEST_F(AsciiLine, P1WhatComesAfterALongerPauseIsNoReply) {
    settings.stations[0].retries = 0;
    BusScript script{settings};
    const Ticket ticket = script.submit(17, kRead);
    script.run_to_end_of_request();
    script.hear(ByteView(kReplyText).first(9));
    script.run_for(1001ms);
    EXPECT_EQ(script.answer(ticket).pdu.error(), Fault::damaged);
    const Ticket other = script.submit(17, read_at(7));
    script.hear(ByteView(kReplyText).subspan(9));
    EXPECT_FALSE(script.answered(other));
}

TEST_F(AsciiLine, StepsOverWhatStandsInFrontOfTheReply) {
    for (const std::string_view front :
         {"\r\n", "noise", "x:11", ":1103", ":11830A62\r", ":2203062A\r\n", ":::"}) {
        SCOPED_TRACE(front);
        const Ticket ticket = ask();
        bus.hear(text(front));
        bus.hear_reply(17, kReply);
        EXPECT_EQ(told(ticket).value(), kReply);
        bus.run_for(1s);
    }
}

TEST_F(AsciiLine, P1AReplyOfAnotherLengthIsNone) {
    const Ticket ticket = ask();
    bus.hear_reply(17, "03 04 02 2B 00 00"_hex);
    EXPECT_FALSE(bus.answered(ticket) && told(ticket).has_value());
    // A lost byte of 00 leaves the LRC right.
    bus.hear_reply(17, "03 06 02 2B 00 00 64"_hex);
    EXPECT_FALSE(bus.answered(ticket) && told(ticket).has_value());
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

TEST_F(AsciiLine, NothingIsSentIntoAFrameThatHasBegun) {
    const TimePoint begun = bus.now();
    bus.hear(text(":"));
    bus.submit(17, kRead);
    bus.run_for(10ms);
    bus.hear(text("1283"));
    bus.run_for(10ms);
    EXPECT_TRUE(bus.sent.empty());
    bus.hear(text("0269\r\n"));
    EXPECT_LT(bus.next_sent().value().at - begun, 30ms);
}

TEST_F(AsciiLine, AReplyOfUnknownLengthNeedsNoSilence) {
    const Ticket ticket = ask("41 01"_hex);
    bus.hear_reply(17, "41 01 02 03 04"_hex);
    EXPECT_EQ(told(ticket).value(), "41 01 02 03 04"_hex);
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
