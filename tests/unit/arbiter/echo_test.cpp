// A line with an echo: the echo is learned, taken out, and confirms no write (P8, T6).
#include "panelgate/arbiter/echo.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::echo_test {
namespace {

using Expect = EchoFilter::Expect;
using modbus::encode_adu;
using test::request_of;

const Bytes kFrame = "11 06 00 01 00 03 9A 9B"_hex;
const Bytes kWriteCoil = "05 00 01 FF 00"_hex;
constexpr int kNoMore = 16;  ///< replies without an echo, after which a known echo is gone

Bytes copy(ByteView bytes) { return {bytes.begin(), bytes.end()}; }

TEST(EchoFilter, TakesTheWholeFrameOutInAnyPieces) {
    const Bytes all = Writer().raw(kFrame).u8(0xAA).u8(0xBB).take();
    for (std::size_t piece = 1; piece <= kFrame.size(); ++piece) {
        EchoFilter filter(kFrame, Expect::certainly);
        Writer rest;
        for (std::size_t at = 0; at < all.size(); at += piece)
            rest.raw(filter.feed(ByteView(all).subspan(at, std::min(piece, all.size() - at))));
        EXPECT_EQ(rest.take(), "AA BB"_hex);
        EXPECT_TRUE(filter.complete());
        EXPECT_FALSE(filter.mismatch());
    }
}

TEST(EchoFilter, DetectsADifferenceAndReturnsWhatItBuffered) {
    for (const Expect expect : {Expect::certainly, Expect::perhaps}) {
        EchoFilter filter(kFrame, expect);
        EXPECT_TRUE(filter.feed("11 06 00"_hex).empty());
        EXPECT_EQ(filter.pending(), expect == Expect::perhaps);
        EXPECT_EQ(copy(filter.feed("FF 01"_hex)), "11 06 00 FF 01"_hex);
        EXPECT_EQ(filter.mismatch(), expect == Expect::certainly);
        EXPECT_FALSE(filter.pending());
    }
}

TEST(EchoFilter, T6TheFirstByteMayBeLost) {
    for (const Expect expect : {Expect::certainly, Expect::perhaps}) {
        EchoFilter filter(kFrame, expect);
        EXPECT_TRUE(filter.feed(ByteView(kFrame).subspan(1, 4)).empty());
        EXPECT_EQ(copy(filter.feed("03 9A 9B AA"_hex).last(1)), "AA"_hex);
        EXPECT_TRUE(filter.complete());
        EchoFilter other(kFrame, expect);
        EXPECT_TRUE(other.feed("06 00"_hex).empty());
        EXPECT_EQ(copy(other.feed("FF"_hex)), "06 00 FF"_hex) << "nothing is made up";
    }
}

TEST(Echo, OnlyARequestWhoseReplyCannotEqualItTeaches) {
    EXPECT_TRUE(teaches_echo(request_of(kRead)));
    EXPECT_TRUE(teaches_echo(request_of("10 00 01 00 01 02 00 03"_hex)));
    EXPECT_FALSE(teaches_echo(request_of(kWriteCoil)));
    EXPECT_FALSE(teaches_echo(request_of("01 03 00 00 18"_hex)))
        << "the reply with 24 coils has 8 bytes, too";
}

TEST(EchoMemory, P8FollowsTheModeOrLearnsWhatReadsShow) {
    EXPECT_EQ(EchoMemory(EchoMode::on).expect(), Expect::certainly);
    EXPECT_EQ(EchoMemory(EchoMode::off).expect(), Expect::nothing);
    EchoMemory memory(EchoMode::automatic);
    EXPECT_EQ(memory.expect(), Expect::perhaps);
    EXPECT_TRUE(memory.must_be_learned_before(request_of(kWrite)));
    EXPECT_FALSE(memory.must_be_learned_before(request_of(kRead)));
    memory.on_no_echo();
    EXPECT_EQ(memory.state(), EchoState::absent);
    EXPECT_TRUE(memory.on_echo());
    EXPECT_FALSE(memory.on_echo()) << "no news";
    EXPECT_EQ(memory.state(), EchoState::present);
    memory.on_mismatch();
    EXPECT_EQ(memory.state(), EchoState::unknown) << "the line is learned again";
}

TEST(EchoMemory, P8AFewRepliesWithoutAnEchoDoNotShowThatAKnownEchoIsGone) {
    EchoMemory memory(EchoMode::automatic);
    memory.on_echo();
    for (int i = 1; i < kNoMore; ++i) memory.on_no_echo();
    EXPECT_EQ(memory.state(), EchoState::present);
    memory.on_no_echo();
    EXPECT_EQ(memory.state(), EchoState::absent);
    EchoMemory configured(EchoMode::on);
    for (int i = 0; i < 2 * kNoMore; ++i) configured.on_no_echo();
    configured.on_mismatch();
    EXPECT_EQ(configured.state(), EchoState::present);
}

/// A line with station 17, without retries.
class EchoLine : public testing::Test {
  protected:
    static Settings with(EchoMode mode) {
        Settings settings = settings_38400();
        for (StationSettings& station : settings.stations) station.retries = 0;
        settings.echo = mode;
        return settings;
    }
    /// The adapter hears the frame that was sent last.
    static void hear_echo(BusScript& bus) {
        const Bytes adu = bus.sent.back().adu;
        bus.hear_paced(adu);
    }
    static void reply(BusScript& bus, ByteView pdu) {
        bus.run_for(3ms);
        bus.hear_reply(17, pdu);
    }
    /// The line carries a read, with an echo or without an echo.
    static void read_once(BusScript& bus, bool echo) {
        const Ticket ticket = bus.submit(17, kRead);
        if (echo) hear_echo(bus);
        answer(bus, 17, kReply, 3ms);
        EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
        bus.run_for(10ms);
    }
    const Symptoms& symptoms() { return bus.arbiter().station_counters().at(17).symptoms; }

    BusScript bus{with(EchoMode::automatic)};
};

TEST_F(EchoLine, P8AWriteIsNeverConfirmedByItsOwnEcho) {
    for (const EchoMode mode : {EchoMode::automatic, EchoMode::on}) {
        for (const Bytes& write : {kWriteCoil, kWrite}) {
            BusScript line(with(mode));
            read_once(line, true);
            const Ticket ticket = line.submit(17, write);
            hear_echo(line);
            line.run_for(2s);
            EXPECT_EQ(line.answer(ticket).pdu.error(), Fault::timeout);
            EXPECT_TRUE(line.answer(ticket).transmitted);
        }
    }
}

TEST_F(EchoLine, P8TheReplyBehindTheEchoConfirmsAWriteAlsoWhenGluedToIt) {
    read_once(bus, true);
    const Ticket ticket = bus.submit(17, kWriteCoil);
    const Bytes adu = bus.sent.back().adu;
    bus.run_to_end_of_request();
    bus.run_for(5ms);
    bus.hear(Writer().raw(adu).raw(adu).take());
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kWriteCoil);
}

TEST_F(EchoLine, P8AFreshLineIsAskedByAReadBeforeItsFirstWrite) {
    const Ticket ticket = bus.submit(17, kWriteCoil);
    ASSERT_EQ(bus.sent.size(), 1u);
    EXPECT_EQ(bus.sent[0].kind, FrameKind::learn_echo);
    EXPECT_EQ(bus.sent[0].adu, encode_adu(17, "03 00 00 00 01"_hex));
    answer(bus, 17, "03 02 00 07"_hex, 3ms);
    ASSERT_EQ(bus.next_sent().value().adu, encode_adu(17, kWriteCoil));
    answer(bus, 17, kWriteCoil, 3ms);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kWriteCoil);
    bus.run_for(10ms);
    bus.submit(17, kWrite);
    EXPECT_EQ(bus.sent.back().adu[1], 6) << "one read is enough";
    bus.line_down();
    bus.line_up();
    bus.run_for(2s);
    bus.submit(17, kWrite);
    EXPECT_EQ(bus.sent.back().kind, FrameKind::learn_echo) << "another device may be there";
}

TEST_F(EchoLine, P8AReplyBehindOtherFramesShowsNothingAboutAnEcho) {
    bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear_paced(encode_adu(18, kReply));
    bus.hear_paced(encode_adu(17, kReply));
    EXPECT_EQ(bus.arbiter().echo(), EchoState::unknown);
}

TEST_F(EchoLine, P8TheFirstWriteToASilentStationIsNotTransmitted) {
    const Ticket ticket = bus.submit(17, kWriteCoil);
    bus.run_for(3s);
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    EXPECT_FALSE(bus.answer(ticket).transmitted);
    for (const auto& sent : bus.sent) EXPECT_EQ(sent.adu[1], 3);
}

TEST_F(EchoLine, P8WhereTheReadWasInconclusiveOneFrameConfirmsNothing) {
    const Ticket ticket = bus.submit(17, kWriteCoil);
    bus.hear(Bytes(bus.sent[0].adu.begin() + 2, bus.sent[0].adu.end()));  // half an echo
    answer(bus, 17, "03 02 00 07"_hex, 3ms);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::unknown);
    ASSERT_EQ(bus.next_sent().value().adu, encode_adu(17, kWriteCoil)) << "one read is enough";
    hear_echo(bus);
    bus.run_for(2s);
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
}

TEST_F(EchoLine, P8AnEchoThatDiffersIsACollision) {
    read_once(bus, true);
    const Ticket ticket = bus.submit(17, kRead);
    Bytes damaged = bus.sent.back().adu;
    damaged.back() ^= 0x10;
    bus.hear_paced(damaged);
    reply(bus, kReply);
    bus.run_for(1s);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply) << "the panel has answered all the same";
    EXPECT_EQ(bus.arbiter().station_counters().at(17).echo_mismatches, 1u);
    EXPECT_EQ(bus.events.back().kind, StationEvent::Kind::collision);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::unknown);
    read_once(bus, true);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::present);
}

/// The CRC of the rest is good where the last byte is 0.
TEST_F(EchoLine, T6OurOwnFrameWithoutALast0IsNoReply) {
    Bytes pdu;
    for (unsigned place = 0; pdu.empty() || encode_adu(17, pdu).back() != 0; ++place)
        pdu = Writer().u8(6).u16(place).u16(4).take();
    read_once(bus, false);
    for (const bool answered : {false, true}) {
        const Ticket ticket = bus.submit(17, pdu);
        bus.run_to_end_of_request();
        const Bytes frame = bus.sent.back().adu;
        bus.hear(ByteView(frame).first(frame.size() - 1));
        bus.run_for(100ms);
        EXPECT_FALSE(bus.answered(ticket));
        if (answered) bus.hear_reply(17, pdu);
        bus.run_for(2s);
        EXPECT_EQ(bus.answer(ticket).pdu.has_value(), answered);
    }
    EXPECT_EQ(symptoms().wrong, 0u);
}

TEST_F(EchoLine, P8WhatStandsInFrontOfTheEchoMakesItNoReply) {
    const Bytes fronts[] = {"FF"_hex, "00"_hex, encode_adu(18, kReply)};
    const Bytes write = "06 00 05 00 00"_hex;
    for (const EchoMode mode : {EchoMode::automatic, EchoMode::on}) {
        for (const Bytes& front : fronts) {
            BusScript line(with(mode));
            read_once(line, true);
            const Ticket ticket = line.submit(17, write);
            line.hear_paced(Writer().raw(front).raw(line.sent.back().adu).take());
            line.run_for(2s);
            ASSERT_TRUE(line.answered(ticket));
            EXPECT_FALSE(line.answer(ticket).pdu) << to_hex(front);
        }
    }
}

TEST_F(EchoLine, P8AnEchoThatTheConfigurationDeniesConfirmsNothingAndIsCounted) {
    BusScript line(with(EchoMode::off));
    read_once(line, true);
    const StationCounters& counters = line.arbiter().station_counters().at(17);
    EXPECT_GE(counters.symptoms.echoes, 1u) << "the finding `echo` tells";
    EXPECT_EQ(counters.foreign_frames, 0u);
    EXPECT_EQ(counters.symptoms.requests, 0u) << "no other master";
}

TEST_F(EchoLine, P8TheEchoOfABroadcastIsNoForeignFrameAndTheNextRequestLeavesAtTheTurnaround) {
    BusScript line(with(EchoMode::on));
    line.submit(0, kWrite, 1);
    const TimePoint start = line.now();
    hear_echo(line);
    line.submit(17, kRead, 2);
    EXPECT_EQ(line.next_sent().value().at - start, wire_time(line.settings().serial, 8) + 100ms);
    EXPECT_EQ(line.arbiter().station_counters().at(17).foreign_frames, 0u);
}

TEST_F(EchoLine, P8TheEchoOfAnUnansweredRequestIsNoSignOfLife) {
    BusScript line(with(EchoMode::on));
    for (int i = 0; i < 3; ++i) {
        const Ticket ticket = line.submit(17, kRead);
        hear_echo(line);
        line.run_for(2s);
        EXPECT_EQ(line.answer(ticket).pdu.error(), Fault::timeout);
    }
    EXPECT_TRUE(line.arbiter().health(17).offline());
}

}  // namespace
}  // namespace panelgate::arbiter::echo_test
