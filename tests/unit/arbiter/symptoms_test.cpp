// Input of the line doctor: how attempts ended, and what else was heard.
#include <gtest/gtest.h>

#include <algorithm>

#include "panelgate/arbiter/arbiter.hpp"
#include "support/bus_script.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::symptoms_test {
namespace {

using test::BusScript;

const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
const Bytes kLongRead = "03 00 00 00 20"_hex;  // 69 bytes of reply

class SymptomsTest : public testing::Test {
  protected:
    SymptomsTest() {
        settings.serial = {38400, 8, Parity::none, 1};
        settings.unlisted.response_timeout = 100ms;
        settings.unlisted.retries = 0;
        settings.stations = {settings.unlisted, settings.unlisted};
        settings.stations[0].id = 17;
        settings.stations[1].id = 18;
    }
    BusScript& bus() {
        if (!script) script.emplace(settings);
        return *script;
    }
    /// Asks and lets these bytes come 3 ms after the request; runs until the line is quiet again.
    void ask(std::uint8_t station, const Bytes& pdu, const Bytes& heard) {
        bus().submit(station, pdu);
        bus().run_to_end_of_request();
        bus().run_for(3ms);
        if (!heard.empty()) bus().hear(heard);
        bus().run_for(400ms);
    }
    const Symptoms& of(std::uint8_t station) {
        return bus().arbiter().station_counters().at(station).symptoms;
    }

    Settings settings;
    std::optional<BusScript> script;
};

TEST_F(SymptomsTest, EveryAttemptEndsInOneWay) {
    ask(17, kRead, modbus::encode_adu(17, kReply));
    ask(17, kRead, {});
    ask(17, kRead, modbus::encode_adu(18, kReply));          // another station answers
    ask(17, kRead, "11 03 06 02 2B 00 00 00 64 C8 BB"_hex);  // right length, wrong CRC
    ask(17, kRead, "11 03 06 02 2B"_hex);
    ask(17, kRead, "00 00 00 00 00 00 00 00 00 00 00 00 FF"_hex);
    ask(17, kLongRead, Bytes(69, 0));
    const Symptoms& s = of(17);
    EXPECT_EQ(s.answered, 1u);
    EXPECT_EQ(s.silent, 1u);
    EXPECT_EQ(s.disturbed, 1u);
    EXPECT_EQ(s.damaged_exact, 2u);
    EXPECT_EQ(s.damaged_short, 1u);
    EXPECT_EQ(s.damaged_long, 1u);
    EXPECT_EQ(s.attempts(), 7u);
    EXPECT_EQ(s.damaged_heads, 2u);
    EXPECT_EQ(s.damaged_bytes, 11u + 5 + 13 + 69);
    EXPECT_EQ(s.damaged_zeros, 3u + 0 + 12 + 69);
    EXPECT_EQ(s.damaged_odd, 3u + 1 + 0 + 0);  // 02, 64 and C8; 02
    EXPECT_EQ(s.long_damaged, 1u);
    EXPECT_EQ(s.strays, 0u);
}

TEST_F(SymptomsTest, RepeatedSilenceIsCountedUntilASoundComes) {
    ask(17, kRead, {});
    ask(17, kRead, {});
    EXPECT_EQ(of(17).mute_in_a_row, 2u);
    ask(17, kRead, Bytes(11, 0));
    EXPECT_EQ(of(17).mute_in_a_row, 0u);
}

TEST_F(SymptomsTest, ThePauseBeforeAnAttemptIsReportedWithItsOutcome) {
    const Ticket first = bus().submit(17, kRead);
    bus().submit(18, kRead, 2);
    bus().run_to_end_of_request();
    bus().run_for(3ms);
    bus().hear_reply(17, kReply);
    EXPECT_TRUE(bus().answered(first));
    bus().run_for(400ms);  // 18 is asked right after that reply, and is silent
    EXPECT_EQ(of(17).answered_after[6], 1u) << "64 ms and more: the line had just come up";
    EXPECT_EQ(of(18).silent_after[0], 0u) << "it may be off";
    ask(18, kRead, modbus::encode_adu(18, kReply));
    EXPECT_EQ(of(18).silent_after[0], 1u) << "the same read is answered: it has missed one";
    EXPECT_EQ(of(18).answered_after[Symptoms::kPauses - 1], 1u);
}

TEST_F(SymptomsTest, AStationThatStaysSilentShowsNothingAboutThePauseBefore) {
    ask(17, kRead, {});
    ask(17, kRead, {});
    EXPECT_GE(of(17).silent, 2u);
    for (std::size_t i = 0; i < Symptoms::kPauses; ++i) EXPECT_EQ(of(17).silent_after[i], 0u) << i;
}

TEST_F(SymptomsTest, AReplyThatComesTwiceIsADuplicateGluedOrApartAndWithOtherValues) {
    const Bytes reply = modbus::encode_adu(17, kReply);
    Bytes twice = reply;
    twice.insert(twice.end(), reply.begin(), reply.end());
    ask(17, kRead, twice);
    EXPECT_EQ(of(17).doubled, 1u);
    bus().submit(17, kRead);
    bus().run_to_end_of_request();
    bus().run_for(3ms);
    bus().hear(reply);
    bus().run_for(20ms);
    bus().hear_reply(17, "03 06 00 00 00 00 00 07"_hex);
    bus().run_for(100ms);
    EXPECT_EQ(of(17).doubled, 2u);
    EXPECT_EQ(of(17).unasked, 0u);
    EXPECT_EQ(of(17).late, 0u);
}

TEST_F(SymptomsTest, ALateReplyIsNoDuplicate) {
    bus().submit(17, kRead);
    bus().run_to_end_of_request();
    bus().run_for(130ms);
    bus().hear_reply(17, kReply);
    bus().run_for(100ms);
    EXPECT_EQ(of(17).late, 1u);
    EXPECT_EQ(of(17).doubled, 0u);
    EXPECT_EQ(of(17).mute_in_a_row, 0u);
    EXPECT_GE(of(17).worst_lateness, Duration(29ms));
    EXPECT_LE(of(17).worst_lateness, 31ms + settings.end_of_frame) << "silence judges it";
}

TEST_F(SymptomsTest, AnotherMastersRequestIsDistinguishedFromNoiseAlsoWhenItsReplyIsGluedToIt) {
    ask(17, kRead, modbus::encode_adu(17, kReply));
    bus().hear_reply(3, "03 00 00 00 01"_hex);
    bus().run_for(100ms);
    Bytes both = modbus::encode_adu(4, "03 00 00 00 01"_hex);
    const Bytes reply = modbus::encode_adu(4, "03 02 00 07"_hex);
    both.insert(both.end(), reply.begin(), reply.end());
    bus().hear(both);
    bus().run_for(100ms);
    EXPECT_EQ(of(17).requests, 2u);
    EXPECT_EQ(of(17).unasked, 0u);
    EXPECT_EQ(of(17).strays, 0u);
    bus().hear("FF 00 12 34 55"_hex);
    bus().run_for(100ms);
    EXPECT_EQ(of(17).strays, 1u);
}

TEST_F(SymptomsTest, TheEchoIsCountedAndIsNoTrouble) {
    for (int i = 0; i < 3; ++i) {
        bus().submit(17, kRead);
        bus().hear(bus().sent.back().adu);
        bus().run_to_end_of_request();
        bus().run_for(3ms);
        bus().hear_reply(17, kReply);
        bus().run_for(100ms);
    }
    EXPECT_EQ(of(17).echoes, 3u);
    EXPECT_EQ(of(17).answered, 3u);
    EXPECT_EQ(of(17).strays + of(17).unasked + of(17).doubled, 0u);
}

TEST_F(SymptomsTest, ACollisionIsOne) {
    settings.echo = EchoMode::on;
    bus().submit(17, kRead);
    Bytes changed = bus().sent.back().adu;
    changed.back() ^= 1;
    bus().hear(changed);
    bus().run_for(400ms);
    EXPECT_EQ(of(17).collided, 1u);
    EXPECT_EQ(of(17).attempts(), 1u);
}

TEST_F(SymptomsTest, AnExceptionWithAnotherFunctionsNumberIsCountedBesides) {
    ask(17, kRead, modbus::encode_adu(17, "84 02"_hex));
    ask(17, kRead, modbus::encode_adu(17, "90 01"_hex));
    ask(17, kRead, modbus::encode_adu(17, "04 02 00 07"_hex));  // no exception
    EXPECT_EQ(of(17).wrong, 3u);
    EXPECT_EQ(of(17).wrong_exceptions, 2u);
}

TEST_F(SymptomsTest, APanelThatAnswersABroadcastIsNotUnsolicited) {
    const Bytes write = "10 00 64 00 01 02 12 34"_hex;
    ask(18, kRead, modbus::encode_adu(18, kReply));
    for (const Bytes& said : {"10 00 64 00 01"_hex, "90 02"_hex}) {
        bus().submit(0, write);
        bus().run_to_end_of_request();
        bus().run_for(3ms);
        bus().hear(modbus::encode_adu(18, said));
        bus().run_for(400ms);
    }
    EXPECT_EQ(of(18).broadcast_replies, 2u);
    EXPECT_EQ(of(18).unasked, 0u);
    bus().submit(0, write);
    bus().run_for(400ms);
    bus().hear(modbus::encode_adu(18, "10 00 64 00 02"_hex));  // of another quantity
    bus().run_for(400ms);
    EXPECT_EQ(of(18).unasked, 1u);
}

TEST_F(SymptomsTest, AnAnswerToABroadcastIsNotWhatTheNextRequestIsAnswered) {
    bus().submit(0, "10 00 64 00 01 02 12 34"_hex);
    bus().run_for(200ms);
    const auto ticket = bus().submit(18, kRead);
    bus().run_to_end_of_request();
    bus().hear(modbus::encode_adu(18, "90 02"_hex));
    bus().run_for(10ms);
    bus().hear(modbus::encode_adu(18, kReply));
    ASSERT_TRUE(bus().answered(ticket));
    EXPECT_EQ(bus().answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(of(18).broadcast_replies, 1u);
    EXPECT_EQ(of(18).wrong, 0u);
}

TEST_F(SymptomsTest, WhatComesLongAfterABroadcastDoesNotAnswerIt) {
    bus().submit(0, "06 00 01 00 03"_hex);
    bus().run_for(400ms);
    for (int i = 0; i < 5; ++i) ask(17, kRead, modbus::encode_adu(17, kReply));
    bus().hear(modbus::encode_adu(18, "06 00 01 00 03"_hex));
    bus().run_for(400ms);
    EXPECT_EQ(of(18).broadcast_replies, 0u);
}

}  // namespace
}  // namespace panelgate::arbiter::symptoms_test
