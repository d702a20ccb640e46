// Input of the line doctor: how attempts ended, and what else was heard.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include "arbiter_fixture.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::symptoms_test {
namespace {

using modbus::encode_adu;

const Bytes kLongRead = "03 00 00 00 20"_hex;  // 69 bytes of reply

Settings settings_with(EchoMode echo) {
    Settings settings = settings_38400();
    for (StationSettings& station : settings.stations) {
        station.response_timeout = 100ms;
        station.retries = 0;
    }
    settings.echo = echo;
    return settings;
}

class SymptomsTest : public testing::Test {
  protected:
    /// Asks and lets these bytes come 3 ms after the request; runs until the line is quiet again.
    void ask(std::uint8_t station, const Bytes& pdu, const Bytes& heard) {
        bus.submit(station, pdu);
        bus.run_to_end_of_request();
        bus.run_for(3ms);
        if (!heard.empty()) bus.hear(heard);
        bus.run_for(400ms);
    }
    void hear(const Bytes& bytes) {
        bus.hear(bytes);
        bus.run_for(400ms);
    }
    const Symptoms& of(std::uint8_t station) {
        return bus.arbiter().station_counters().at(station).symptoms;
    }

    BusScript bus{settings_with(EchoMode::off)};
};

TEST_F(SymptomsTest, EveryAttemptEndsInOneWay) {
    ask(17, kRead, encode_adu(17, kReply));
    ask(17, kRead, {});
    ask(17, kRead, encode_adu(18, kReply));                  // another station answers
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

TEST_F(SymptomsTest, RepeatedSilenceIsCountedUntilASoundComesAndSaysNothingAboutThePauseBefore) {
    ask(17, kRead, {});
    ask(17, kRead, {});
    EXPECT_GE(of(17).silent, 2u);
    EXPECT_EQ(of(17).mute_in_a_row, 2u);
    for (std::size_t i = 0; i < Symptoms::kPauses; ++i) EXPECT_EQ(of(17).silent_after[i], 0u) << i;
    ask(17, kRead, Bytes(11, 0));
    EXPECT_EQ(of(17).mute_in_a_row, 0u);
}

TEST_F(SymptomsTest, ThePauseBeforeAnAttemptIsReportedWithItsOutcome) {
    const Ticket first = bus.submit(17, kRead);
    bus.submit(18, kRead, 2);
    answer(bus, 17, kReply, 3ms);
    EXPECT_TRUE(bus.answered(first));
    bus.run_for(400ms);  // 18 is asked right after that reply, and is silent
    EXPECT_EQ(of(17).answered_after[6], 1u) << "64 ms and more: the line had just come up";
    EXPECT_EQ(of(18).silent_after[0], 0u) << "it may be off";
    ask(18, kRead, encode_adu(18, kReply));
    EXPECT_EQ(of(18).silent_after[0], 1u) << "the same read is answered: it has missed one";
    EXPECT_EQ(of(18).answered_after[Symptoms::kPauses - 1], 1u);
}

TEST_F(SymptomsTest, WhatMayHaveBeenTheReplyIsNoEchoForCertain) {
    Settings settings = bus.settings();
    settings.echo = EchoMode::on;  // there is none
    BusScript script{settings};
    script.submit(17, kWrite);
    answer(script, 17, kWrite, 3ms);
    script.run_for(3s);
    EXPECT_EQ(script.arbiter().station_counters().at(17).symptoms.echoes, 0u);
}

TEST_F(SymptomsTest, ACollisionIsOne) {
    BusScript script{settings_with(EchoMode::on)};
    script.submit(17, kRead);
    Bytes changed = script.sent.back().adu;
    changed.back() ^= 1;
    script.hear(changed);
    script.run_for(400ms);
    const Symptoms& s = script.arbiter().station_counters().at(17).symptoms;
    EXPECT_EQ(s.collided, 1u);
    EXPECT_EQ(s.attempts(), 1u);
}

TEST_F(SymptomsTest, TheAnswerWithAnotherAddressIsCountedForTheAskedStation) {
    ask(18, kRead, encode_adu(18, kReply));
    bus.run_for(timing::kSecondPanel);
    ask(17, kRead, encode_adu(18, reply_number(7)));
    ask(17, kRead, encode_adu(18, "03 02 00 07"_hex));  // another length answers nothing
    EXPECT_EQ(of(17).misaddressed, 1u);
    EXPECT_EQ(of(18).misaddressed, 0u);
}

TEST_F(SymptomsTest, AReadThatIsAnsweredWhenAskedAgainWasMissed) {
    ask(17, read_at(1), {});
    ask(17, read_at(2), encode_adu(17, reply_number(2)));
    ask(17, read_at(1), encode_adu(17, reply_number(1)));
    ask(17, read_at(3), {});
    ask(17, read_at(2), encode_adu(17, reply_number(4)));
    EXPECT_EQ(of(17).silences, 2u);
    EXPECT_EQ(of(17).repeated, 1u) << "the third may be a place that it lacks";
}

}  // namespace
}  // namespace panelgate::arbiter::symptoms_test
