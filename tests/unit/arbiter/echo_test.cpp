#include "panelgate/arbiter/echo.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "echo_fixture.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::echo::echo_test {
namespace {

using Expect = EchoFilter::Expect;

const Bytes kFrame = "11 06 00 01 00 03 9A 9B"_hex;

Bytes copy(ByteView bytes) { return {bytes.begin(), bytes.end()}; }

TEST(EchoFilter, TakesTheWholeFrameOutInAnyPieces) {
    for (std::size_t piece = 1; piece <= kFrame.size(); ++piece) {
        EchoFilter filter(kFrame, Expect::certainly);
        Bytes rest;
        Bytes all = kFrame;
        all.insert(all.end(), {0xAA, 0xBB});
        for (std::size_t at = 0; at < all.size(); at += piece) {
            const auto part = ByteView(all).subspan(at, std::min(piece, all.size() - at));
            const Bytes left = copy(filter.feed(part));
            rest.insert(rest.end(), left.begin(), left.end());
        }
        EXPECT_EQ(rest, "AA BB"_hex);
        EXPECT_TRUE(filter.complete());
        EXPECT_FALSE(filter.mismatch());
    }
}

TEST(EchoFilter, DetectsADifferenceAndReturnsWhatItBuffered) {
    EchoFilter sure(kFrame, Expect::certainly);
    EXPECT_TRUE(sure.feed("11 06 00"_hex).empty());
    EXPECT_EQ(copy(sure.feed("FF 01"_hex)), "11 06 00 FF 01"_hex);
    EXPECT_TRUE(sure.mismatch());

    EchoFilter unsure(kFrame, Expect::perhaps);
    EXPECT_TRUE(unsure.feed("11 06 00"_hex).empty());
    EXPECT_TRUE(unsure.pending());
    EXPECT_EQ(copy(unsure.feed("FF 01"_hex)), "11 06 00 FF 01"_hex);
    EXPECT_FALSE(unsure.mismatch());
    EXPECT_FALSE(unsure.pending());
}

TEST(EchoFilter, GivesBackWhatNeverBecameTheEcho) {
    EchoFilter filter(kFrame, Expect::perhaps);
    EXPECT_TRUE(filter.feed("11 06 00"_hex).empty());
    EXPECT_EQ(filter.release(), "11 06 00"_hex);
    EXPECT_TRUE(filter.release().empty());
    EXPECT_EQ(copy(filter.feed("01 00"_hex)), "01 00"_hex);
}

TEST(EchoMemory, LearnsOnlyFromRequestsWhoseAnswerCannotBeTheirEcho) {
    EchoMemory memory(EchoMode::automatic);
    EXPECT_FALSE(memory.on_echo(test::request_of(kWriteRegister)));
    EXPECT_EQ(memory.state(), EchoState::unknown);
    EXPECT_FALSE(memory.on_echo(test::request_of("01 03 00 00 18"_hex)))
        << "24 coils: its reply has 8 bytes, too";
    EXPECT_EQ(memory.state(), EchoState::unknown);
    EXPECT_TRUE(memory.on_echo(test::request_of(kRead)));
    EXPECT_FALSE(memory.on_echo(test::request_of(kRead))) << "no news";
    EXPECT_EQ(memory.expect(test::request_of(kWriteRegister)), Expect::certainly);
    memory.forget();
    EXPECT_TRUE(memory.must_be_learned_before(test::request_of(kWriteRegister), false));
}

TEST_F(Echo, P8AWriteIsNeverConfirmedByItsOwnEcho) {
    for (const EchoMode mode : {EchoMode::automatic, EchoMode::on}) {
        for (const Bytes& write : {kWriteCoil, kWriteRegister}) {
            BusScript bus(settings(mode));
            read_once(bus, true);
            const Ticket ticket = bus.submit(17, write);
            hear_echo(bus);
            bus.run_for(2s);
            ASSERT_TRUE(bus.answered(ticket));
            ASSERT_FALSE(bus.answer(ticket).pdu.has_value());
            EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
            EXPECT_TRUE(bus.answer(ticket).transmitted);
        }
    }
}

TEST_F(Echo, P8TheReplyBehindTheEchoConfirmsAWriteAlsoWhenGluedToIt) {
    BusScript bus(settings(EchoMode::automatic));
    read_once(bus, true);
    const Ticket ticket = bus.submit(17, kWriteCoil);
    Bytes both = bus.sent.back().adu;
    bus.run_to_end_of_request();
    bus.run_for(5ms);
    const Bytes again = both;
    both.insert(both.end(), again.begin(), again.end());
    bus.hear(both);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kWriteCoil);
}

TEST_F(Echo, P8AFreshLineIsAskedByAReadBeforeItsFirstWrite) {
    BusScript bus(settings(EchoMode::automatic));
    const Ticket ticket = bus.submit(17, kWriteCoil);
    ASSERT_EQ(bus.sent.size(), 1u);
    EXPECT_EQ(bus.sent[0].adu[1], 3);
    bus.run_to_end_of_request();
    reply(bus, "03 02 00 07"_hex);
    ASSERT_EQ(bus.next_sent()->adu, modbus::encode_adu(17, kWriteCoil));
    bus.run_to_end_of_request();
    reply(bus, kWriteCoil);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kWriteCoil);
    EXPECT_EQ(bus.sent.size(), 2u);
    // Once is enough.
    bus.run_for(10ms);
    bus.submit(17, kWriteRegister);
    EXPECT_EQ(bus.sent.back().adu[1], 6);
}

TEST_F(Echo, P8AnExceptionTeachesAsWellAsAValue) {
    BusScript bus(settings(EchoMode::automatic));
    bus.submit(17, kWriteCoil);
    hear_echo(bus);
    reply(bus, "83 02"_hex);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::present);
    EXPECT_EQ(bus.next_sent()->adu, modbus::encode_adu(17, kWriteCoil));
}

TEST(EchoMemory, P8AnEchoThatMayHaveBeenTheAnswerItselfIsLearnedAgain) {
    EchoMemory memory(EchoMode::automatic);
    const Bytes read = "03 00 00 00 03"_hex;
    const Bytes write = "06 00 00 00 03"_hex;
    ASSERT_TRUE(memory.on_echo(test::request_of(read)));
    memory.on_unanswered(test::request_of(read));
    EXPECT_EQ(memory.state(), EchoState::present) << "no read is answered by itself";
    memory.on_unanswered(test::request_of(write));
    EXPECT_EQ(memory.state(), EchoState::unclear);
    EXPECT_TRUE(memory.must_be_learned_before(test::request_of(write), false));
    constexpr int kReads = 16;
    for (int i = 1; i < kReads; ++i) memory.on_reply_without_echo(test::request_of(read), false);
    EXPECT_EQ(memory.state(), EchoState::unclear) << "bytes may be lost now and then";
    memory.on_reply_without_echo(test::request_of(read), false);
    EXPECT_EQ(memory.state(), EchoState::absent);
}

TEST(EchoMemory, P8AFewRepliesWithoutAnEchoDoNotShowThatAKnownEchoIsGone) {
    EchoMemory memory(EchoMode::automatic);
    EXPECT_TRUE(memory.on_echo(test::request_of(kRead)));
    memory.on_mismatch();
    EXPECT_TRUE(memory.expects_one()) << "it has been heard";
    for (int i = 0; i < 15; ++i) memory.on_reply_without_echo(test::request_of(kRead), false);
    EXPECT_TRUE(memory.expects_one());
    EXPECT_TRUE(memory.must_be_learned_before(test::request_of(kWriteRegister), false));
    memory.on_reply_without_echo(test::request_of(kRead), false);
    EXPECT_FALSE(memory.expects_one());
    memory.forget();
    EXPECT_FALSE(memory.expects_one()) << "another device";
}

TEST_F(Echo, P8AReplyAfterAForeignFrameShowsNothingAboutAnEcho) {
    BusScript bus(settings(EchoMode::automatic));
    bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear_paced(modbus::encode_adu(18, kReply));
    bus.hear_paced(modbus::encode_adu(17, kReply));
    EXPECT_EQ(bus.arbiter().echo(), EchoState::unknown);
}

TEST_F(Echo, P8AReplyAfterARequestOfAnotherMasterShowsNothingAboutAnEcho) {
    BusScript bus(settings(EchoMode::automatic));
    bus.submit(17, kRead);
    bus.run_to_end_of_request();
    Bytes heard = modbus::encode_adu(18, "04 00 01 00 02"_hex);
    Bytes echo = bus.sent.back().adu;
    echo[3] ^= 0x10;
    heard.insert(heard.end(), echo.begin(), echo.end());
    bus.hear_paced(heard);
    bus.hear_paced(modbus::encode_adu(17, kReply));
    EXPECT_NE(bus.arbiter().echo(), EchoState::absent) << "a damaged echo stood there as well";
}

TEST_F(Echo, P4AnotherMastersRepliesOfOurStationMakeItRestForNothing) {
    BusScript bus(settings(EchoMode::off));
    for (int i = 0; i < 20; ++i) {
        const Ticket ticket = bus.submit(17, kRead);
        const TimePoint asked = bus.now();
        bus.run_to_end_of_request();
        bus.hear_reply(17, kReply);
        ASSERT_TRUE(bus.answered(ticket));
        EXPECT_LT(bus.now() - asked, 150ms);
        bus.run_for(20ms);
        bus.hear(modbus::encode_adu(17, "03 00 00 00 03"_hex));
        bus.run_for(10ms);
        bus.hear_reply(17, i % 2 == 0 ? kReply : "03 06 00 01 00 02 00 03"_hex);
        bus.run_for(10ms);
    }
}

TEST_F(Echo, P8TheFirstWriteToASilentStationIsNotTransmitted) {
    BusScript bus(settings(EchoMode::automatic));
    const Ticket ticket = bus.submit(17, kWriteCoil);
    bus.run_for(3s);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    EXPECT_FALSE(bus.answer(ticket).transmitted);
    for (const auto& sent : bus.sent) EXPECT_EQ(sent.adu[1], 3);
}

TEST_F(Echo, P8ALineWhereAReadWasInconclusiveConfirmsNothingByOneFrame) {
    BusScript bus(settings(EchoMode::automatic));
    const Ticket ticket = bus.submit(17, kWriteCoil);
    const Bytes tail(bus.sent[0].adu.begin() + 2, bus.sent[0].adu.end());
    bus.hear(tail);  // half an echo
    bus.run_to_end_of_request();
    reply(bus, "03 02 00 07"_hex);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::unclear);
    ASSERT_EQ(bus.next_sent()->adu, modbus::encode_adu(17, kWriteCoil)) << "one read is enough";
    hear_echo(bus);
    bus.run_for(2s);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
}

TEST_F(Echo, P8AnEchoThatDiffersIsACollision) {
    BusScript bus(settings(EchoMode::automatic));
    read_once(bus, true);
    const Ticket ticket = bus.submit(17, kRead);
    Bytes damaged = bus.sent.back().adu;
    damaged.back() ^= 0x10;
    bus.hear_paced(damaged);
    reply(bus, kReply);
    bus.run_for(1s);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply) << "which the panel gave all the same";
    EXPECT_EQ(bus.arbiter().station_counters().at(17).echo_mismatches, 1u);
    EXPECT_EQ(bus.events.back().kind, StationEvent::Kind::collision);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::unclear);
    read_once(bus, true);  // and is learned again
    EXPECT_EQ(bus.arbiter().echo(), EchoState::present);
}

TEST_F(Echo, P8AnAdapterThatNoLongerHearsItselfIsLearnedAnew) {
    BusScript bus(settings(EchoMode::automatic));
    read_once(bus, true);
    const Ticket lost = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    reply(bus, kReply);
    bus.run_for(1s);
    EXPECT_EQ(bus.answer(lost).pdu.value(), kReply);
    constexpr int kReads = 16;
    for (int i = 0; i < kReads; ++i) {
        bus.submit(17, kRead);
        bus.run_to_end_of_request();
        reply(bus, kReply);
        bus.run_for(1s);
    }
    EXPECT_EQ(bus.arbiter().echo(), EchoState::absent);
}

TEST_F(Echo, P1AFrameBeforeTheEchoIsAnotherMasters) {
    for (const EchoMode mode : {EchoMode::automatic, EchoMode::on}) {
        BusScript bus(settings(mode));
        read_once(bus, true);
        for (const bool alive : {true, false, true}) {
            const Ticket ticket = bus.submit(17, kRead);
            bus.hear_reply(17, "03 06 00 09 00 09 00 09"_hex);
            hear_echo(bus);
            EXPECT_FALSE(bus.answered(ticket));
            if (alive) reply(bus, kReply);
            bus.run_for(2s);
            ASSERT_TRUE(bus.answered(ticket));
            if (alive) EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
            if (!alive) EXPECT_FALSE(bus.answer(ticket).pdu);
        }
    }
}

TEST_F(Echo, P8AWriteIsNotConfirmedByWhatComesBeforeItsEcho) {
    BusScript bus(settings(EchoMode::on));
    const Ticket ticket = bus.submit(17, "0F 00 10 00 08 01 55"_hex);
    bus.hear_reply(17, "0F 00 10 00 08"_hex);
    hear_echo(bus);
    bus.run_for(2s);
    EXPECT_FALSE(bus.answer(ticket).pdu);
}

TEST_F(Echo, P1AReplyAfterAnotherMastersRequestOfItsShapeIsAmbiguous) {
    BusScript bus(settings(EchoMode::off));
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear(modbus::encode_adu(17, "03 00 00 00 03"_hex));
    bus.hear_reply(17, kReply);
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_for(2s);
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::damaged) << "not silent";
    // Reads beyond it are distinguished.
    const Ticket next = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear(modbus::encode_adu(17, "03 00 00 00 01"_hex));
    bus.hear_reply(17, "03 02 00 07"_hex);
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(next).pdu.value(), kReply);
}

TEST_F(Echo, P8AnEchoThatTheConfigurationDeniesIsFoundAllTheSame) {
    BusScript bus(settings(EchoMode::off));
    const Ticket ticket = bus.submit(17, kRead);
    hear_echo(bus);
    reply(bus, kReply);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    ASSERT_FALSE(bus.events.empty());
    EXPECT_EQ(bus.events[0].kind, StationEvent::Kind::echo);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).discarded_bytes, 0u);
}

TEST_F(Echo, P8TheEchoOfABroadcastIsNoForeignFrameAndTheNextRequestLeavesAtTheTurnaround) {
    BusScript bus(settings(EchoMode::on));
    bus.submit(0, kWriteRegister, 1);
    const TimePoint start = bus.now();
    hear_echo(bus);
    bus.submit(17, kRead, 2);
    const auto next = bus.next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->at - start, wire_time({38400, 8, Parity::none, 1}, 8) + 100ms);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).discarded_bytes, 0u);
}

TEST_F(Echo, P8TheEchoOfAnUnansweredRequestIsNoSignOfLife) {
    BusScript bus(settings(EchoMode::on));
    for (int i = 0; i < 3; ++i) {
        const Ticket ticket = bus.submit(17, kRead);
        hear_echo(bus);
        bus.run_for(2s);
        EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    }
    EXPECT_TRUE(bus.arbiter().health(17).offline());
}

}  // namespace
}  // namespace panelgate::arbiter::echo::echo_test
