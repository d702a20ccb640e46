// The line hears what it sends: that is learned, taken out, and confirms no write (P8).
#include "panelgate/arbiter/habits/echo.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>

#include "arbiter_fixture.hpp"
#include "panelgate/arbiter/habits/reply_times.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::echo_test {
namespace {

using modbus::encode_adu;

const Bytes kWriteCoil = "05 00 01 FF 00"_hex;
constexpr int kNoMore = 16;  ///< replies without an echo after which a known one is gone

class Echo : public testing::Test {
  protected:
    static Settings with(EchoMode mode) {
        Settings settings;
        settings.serial = {38400, 8, Parity::none, 1};
        settings.unlisted.retries = 0;
        settings.stations = {settings.unlisted};
        settings.stations[0].id = 17;
        settings.echo = mode;
        return settings;
    }
    /// The adapter hears what was sent last; then the station answers, or not.
    static void hear_echo(BusScript& bus) {
        const Bytes adu = bus.sent.back().adu;
        bus.hear_paced(adu);
    }
    static void reply(BusScript& bus, ByteView pdu) {
        bus.run_for(3ms);
        bus.hear_reply(17, pdu);
    }
    /// A line that has carried a read and is known to have an echo, or not to have one.
    static void read_once(BusScript& bus, bool echo) {
        const Ticket ticket = bus.submit(17, kRead);
        if (echo) hear_echo(bus);
        answer(bus, 17, kReply, 3ms);
        EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
        bus.run_for(10ms);
    }
};

/// A line whose echo is learned.
class LearnedEcho : public Echo {
  protected:
    BusScript bus{with(EchoMode::automatic)};
};

TEST_F(Echo, P8AWriteIsNeverConfirmedByItsOwnEcho) {
    for (const EchoMode mode : {EchoMode::automatic, EchoMode::on}) {
        for (const Bytes& write : {kWriteCoil, kWrite}) {
            BusScript bus(with(mode));
            read_once(bus, true);
            const Ticket ticket = bus.submit(17, write);
            hear_echo(bus);
            bus.run_for(2s);
            EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
            EXPECT_TRUE(bus.answer(ticket).transmitted);
        }
    }
}

TEST_F(LearnedEcho, P8TheReplyBehindTheEchoConfirmsAWriteAlsoWhenGluedToIt) {
    read_once(bus, true);
    const Ticket ticket = bus.submit(17, kWriteCoil);
    const Bytes adu = bus.sent.back().adu;
    bus.run_to_end_of_request();
    bus.run_for(5ms);
    bus.hear(Writer().raw(adu).raw(adu).take());
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kWriteCoil);
}

TEST_F(LearnedEcho, P8AFreshLineIsAskedByAReadBeforeItsFirstWrite) {
    const Ticket ticket = bus.submit(17, kWriteCoil);
    ASSERT_EQ(bus.sent.size(), 1u);
    EXPECT_EQ(bus.sent[0].adu[1], 3);
    answer(bus, 17, "03 02 00 07"_hex, 3ms);
    ASSERT_EQ(bus.next_sent().value().adu, encode_adu(17, kWriteCoil));
    answer(bus, 17, kWriteCoil, 3ms);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kWriteCoil);
    EXPECT_EQ(bus.sent.size(), 2u);
    // Once is enough.
    bus.run_for(10ms);
    bus.submit(17, kWrite);
    EXPECT_EQ(bus.sent.back().adu[1], 6);
}

TEST_F(LearnedEcho, P8AnExceptionTeachesAsWellAsAValue) {
    bus.submit(17, kWriteCoil);
    hear_echo(bus);
    reply(bus, "83 02"_hex);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::present);
    EXPECT_EQ(bus.next_sent().value().adu, encode_adu(17, kWriteCoil));
}

TEST_F(LearnedEcho, P8AReplyAfterAForeignFrameShowsNothingAboutAnEcho) {
    bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear_paced(encode_adu(18, kReply));
    bus.hear_paced(encode_adu(17, kReply));
    EXPECT_EQ(bus.arbiter().echo(), EchoState::unknown);
}

TEST_F(LearnedEcho, P8AReplyAfterARequestOfAnotherMasterShowsNothingAboutAnEcho) {
    bus.submit(17, kRead);
    bus.run_to_end_of_request();
    Bytes echo = bus.sent.back().adu;
    echo[3] ^= 0x10;
    bus.hear_paced(Writer().raw(encode_adu(18, "04 00 01 00 02"_hex)).raw(echo).take());
    bus.hear_paced(encode_adu(17, kReply));
    EXPECT_NE(bus.arbiter().echo(), EchoState::absent) << "a damaged echo stood there as well";
}

TEST_F(LearnedEcho, P8TheFirstWriteOfALineIsNotConfirmedByWhatComesSoonerThanAnyReplyHas) {
    read_once(bus, false);
    const Ticket ticket = bus.submit(17, kWrite);
    hear_echo(bus);
    bus.run_for(2s);
    EXPECT_FALSE(bus.answer(ticket).pdu);
}

/// The panel may not have heard the request, and says its refusal of the one before once more.
TEST_F(LearnedEcho, P1ARefusalSaidAgainBehindACollisionIsAskedForOnceMore) {
    read_once(bus, true);
    bus.submit(17, "03 00 6C 00 01"_hex);
    hear_echo(bus);
    reply(bus, "83 06"_hex);
    bus.run_for(10ms);
    const Ticket ticket = bus.submit(17, kRead);
    Bytes damaged = bus.sent.back().adu;
    damaged[damaged.size() - 3] ^= 0x10;
    bus.hear_paced(damaged);
    reply(bus, "83 06"_hex);
    ASSERT_EQ(bus.next_sent(2s).value().kind, FrameKind::retry);
    hear_echo(bus);
    reply(bus, kReply);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
}

TEST_F(Echo, P4AnotherMastersRepliesOfOurStationMakeItRestForNothing) {
    BusScript bus(with(EchoMode::off));
    for (int i = 0; i < 20; ++i) {
        const Ticket ticket = bus.submit(17, kRead);
        const TimePoint asked = bus.now();
        answer(bus, 17, kReply);
        ASSERT_TRUE(bus.answered(ticket));
        EXPECT_LT(bus.now() - asked, 150ms);
        bus.run_for(20ms);
        bus.hear(encode_adu(17, "03 00 00 00 03"_hex));
        bus.run_for(10ms);
        bus.hear_reply(17, i % 2 == 0 ? kReply : reply_number(1));
        bus.run_for(10ms);
    }
}

TEST_F(LearnedEcho, P8TheFirstWriteToASilentStationIsNotTransmitted) {
    const Ticket ticket = bus.submit(17, kWriteCoil);
    bus.run_for(3s);
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    EXPECT_FALSE(bus.answer(ticket).transmitted);
    for (const auto& sent : bus.sent) EXPECT_EQ(sent.adu[1], 3);
}

TEST_F(LearnedEcho, P8ALineWhereAReadWasInconclusiveConfirmsNothingByOneFrame) {
    const Ticket ticket = bus.submit(17, kWriteCoil);
    const Bytes tail(bus.sent[0].adu.begin() + 2, bus.sent[0].adu.end());
    bus.hear(tail);  // half an echo
    answer(bus, 17, "03 02 00 07"_hex, 3ms);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::unclear);
    ASSERT_EQ(bus.next_sent().value().adu, encode_adu(17, kWriteCoil)) << "one read is enough";
    hear_echo(bus);
    bus.run_for(2s);
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
}

TEST_F(LearnedEcho, P8AnEchoThatDiffersIsACollision) {
    read_once(bus, true);
    const Ticket ticket = bus.submit(17, kRead);
    Bytes damaged = bus.sent.back().adu;
    damaged.back() ^= 0x10;
    bus.hear_paced(damaged);
    reply(bus, kReply);
    bus.run_for(1s);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply) << "which the panel gave all the same";
    EXPECT_EQ(bus.arbiter().station_counters().at(17).echo_mismatches, 1u);
    EXPECT_EQ(bus.events.back().kind, StationEvent::Kind::collision);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::unclear);
    read_once(bus, true);  // and is learned again
    EXPECT_EQ(bus.arbiter().echo(), EchoState::present);
}

TEST_F(LearnedEcho, P8AnAdapterThatNoLongerHearsItselfIsLearnedAnew) {
    read_once(bus, true);
    for (int i = 0; i <= kNoMore; ++i) {
        const Ticket ticket = bus.submit(17, kRead);
        answer(bus, 17, kReply, 3ms);
        bus.run_for(1s);
        if (i == 0) EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    }
    EXPECT_EQ(bus.arbiter().echo(), EchoState::absent);
}

TEST_F(Echo, P1AFrameBeforeTheEchoIsAnotherMasters) {
    for (const EchoMode mode : {EchoMode::automatic, EchoMode::on}) {
        BusScript bus(with(mode));
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
    BusScript bus(with(EchoMode::on));
    const Ticket ticket = bus.submit(17, "0F 00 10 00 08 01 55"_hex);
    bus.hear_reply(17, "0F 00 10 00 08"_hex);
    hear_echo(bus);
    bus.run_for(2s);
    EXPECT_FALSE(bus.answer(ticket).pdu);
}

TEST_F(Echo, P1AReplyAfterAnotherMastersRequestOfItsShapeIsAmbiguous) {
    BusScript bus(with(EchoMode::off));
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear(encode_adu(17, "03 00 00 00 03"_hex));
    bus.hear_reply(17, kReply);
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_for(2s);
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::damaged) << "not silent";
    // Reads beyond it are distinguished.
    const Ticket next = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear(encode_adu(17, "03 00 00 00 01"_hex));
    bus.hear_reply(17, "03 02 00 07"_hex);
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(next).pdu.value(), kReply);
}

/// A repeater, or a radio.
TEST_F(Echo, P8AnEchoThatComesLateConfirmsNothingAndIsNoValue) {
    BusScript bus(with(EchoMode::automatic));
    const auto come_back = [&] {
        bus.run_for(40ms);
        bus.hear(bus.sent.back().adu);
    };
    for (int i = 0; i < 5; ++i) {
        bus.submit(17, kRead);
        answer(bus, 17, kReply, 5ms);
        come_back();
        bus.run_for(50ms);
    }
    const std::uint64_t requests = bus.arbiter().station_counters().at(17).symptoms.requests;
    for (const Bytes& pdu : {kWriteCoil, "01 03 75 00 18"_hex}) {
        const Ticket ticket = bus.submit(17, pdu);
        ASSERT_EQ(bus.sent.back().adu, encode_adu(17, pdu));
        bus.run_to_end_of_request();
        come_back();
        bus.run_for(2s);
        EXPECT_FALSE(bus.answer(ticket).pdu);
    }
    const Symptoms& symptoms = bus.arbiter().station_counters().at(17).symptoms;
    EXPECT_EQ(symptoms.requests, requests) << "another master's";
    EXPECT_GE(symptoms.echoed_again, 3u);
}

TEST_F(Echo, P8AnEchoThatTheConfigurationDeniesIsFoundAllTheSame) {
    BusScript bus(with(EchoMode::off));
    for (int i = 0; i < 3; ++i) {
        EXPECT_TRUE(bus.events.empty()) << "a panel may repeat a request once";
        read_once(bus, true);
    }
    ASSERT_FALSE(bus.events.empty());
    EXPECT_EQ(bus.events[0].kind, StationEvent::Kind::echo);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).discarded_bytes, 0u);
}

TEST_F(Echo, P8TheEchoOfABroadcastIsNoForeignFrameAndTheNextRequestLeavesAtTheTurnaround) {
    BusScript bus(with(EchoMode::on));
    bus.submit(0, kWrite, 1);
    const TimePoint start = bus.now();
    hear_echo(bus);
    bus.submit(17, kRead, 2);
    EXPECT_EQ(bus.next_sent().value().at - start, wire_time(bus.settings().serial, 8) + 100ms);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).discarded_bytes, 0u);
}

/// One panel that repeats a request made healthy ones wait for echoes that never came.
TEST_F(Echo, P4APanelThatRepeatsOneRequestMakesNoLineThatHearsItself) {
    BusScript bus(with(EchoMode::off));
    read_once(bus, true);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::unknown);
    bus.submit(17, kWrite);
    EXPECT_EQ(bus.sent.back().kind, FrameKind::learn_echo) << "P8";
    answer(bus, 17, kReply, 3ms);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::absent);
}

TEST_F(Echo, P8TheEchoOfAnUnansweredRequestIsNoSignOfLife) {
    BusScript bus(with(EchoMode::on));
    for (int i = 0; i < 3; ++i) {
        const Ticket ticket = bus.submit(17, kRead);
        hear_echo(bus);
        bus.run_for(2s);
        EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    }
    EXPECT_TRUE(bus.arbiter().health(17).offline());
}

/// Two converters in a row: each request comes back twice. A read has shown it.
class EchoTwice : public LearnedEcho {
  protected:
    EchoTwice() {
        for (unsigned i = 0; i < RecentTimes::kEnough; ++i) read_once(bus, true);
        const Ticket read = bus.submit(17, kRead);
        hear_twice(kReply);
        EXPECT_EQ(bus.answer(read).pdu.value(), kReply);
        bus.run_for(10ms);
        write = bus.submit(17, kWrite);
        hear_echo(bus);
        bus.hear(bus.sent.back().adu);
        EXPECT_FALSE(bus.answered(write));
    }
    void hear_twice(ByteView reply) {
        hear_echo(bus);
        bus.hear(bus.sent.back().adu);
        bus.run_for(3ms);
        bus.hear_paced(encode_adu(17, reply));
    }
    /// A read of what was written finds this.
    void find(ByteView pdu) {
        ASSERT_EQ(bus.next_sent(600ms).value().adu, encode_adu(17, "03 00 01 00 01"_hex));
        hear_twice(pdu);
    }
    Ticket write = 0;
};

TEST_F(EchoTwice, P8ConfirmsNoWrite) {
    find("03 02 00 04"_hex);
    EXPECT_EQ(bus.answer(write).pdu.error(), Fault::timeout);
}

TEST_F(EchoTwice, P8ConfirmsAWriteWhoseValueIsThere) {
    find("03 02 00 03"_hex);
    EXPECT_EQ(bus.answer(write).pdu.value(), kWrite);
}

TEST_F(EchoTwice, P8TheReplyBehindItConfirmsTheWrite) {
    reply(bus, kWrite);
    EXPECT_EQ(bus.answer(write).pdu.value(), kWrite);
    EXPECT_EQ(bus.sent.back().adu, encode_adu(17, kWrite)) << "no read is needed";
    EXPECT_EQ(bus.arbiter().station_counters().at(17).symptoms.echoed_again, 1u);
}

/// A converter that returns what was sent when the panel has answered, or would have.
TEST_F(LearnedEcho, P8AnEchoBehindTheReplyOfAReadConfirmsNoWrite) {
    for (unsigned i = 0; i < RecentTimes::kEnough; ++i) read_once(bus, false);
    bus.submit(17, kRead);
    answer(bus, 17, kReply, 3ms);
    bus.hear(bus.sent.back().adu);
    bus.run_for(10ms);
    for (const std::ptrdiff_t begun : {0, 3, 7, 8}) {  // bytes of it that are read with the reply
        const bool done = begun < 8;
        const Ticket write = bus.submit(17, kWrite);
        const Bytes frame = bus.sent.back().adu;
        Bytes first = frame;
        if (done) first.insert(first.end(), frame.begin(), frame.begin() + begun);
        bus.run_to_end_of_request();
        bus.run_for(3ms);
        bus.hear(first);
        EXPECT_FALSE(bus.answered(write));
        if (done) bus.hear(Bytes(frame.begin() + begun, frame.end()));
        EXPECT_EQ(bus.answered(write), done);
        bus.run_for(100ms);
        if (!done) answer(bus, 17, "03 02 00 04"_hex, 3ms);
        if (!done) EXPECT_EQ(bus.answer(write).pdu.error(), Fault::timeout);
    }
}

/// An adapter, or a receiver that is stuck, begins to echo while the device stays open: a line
/// without an echo, whose station has answered; then a write, and its very frame comes back as it
/// leaves.
class EchoInMidLife : public LearnedEcho {
  protected:
    EchoInMidLife() {
        for (unsigned i = 0; i < RecentTimes::kEnough; ++i) read_once(bus, false);
        write = bus.submit(17, kWrite);
        hear_echo(bus);
        EXPECT_FALSE(bus.answered(write));
    }
    /// A read is sent that detects the echo.
    void ask() { ASSERT_EQ(bus.next_sent(600ms).value().kind, FrameKind::learn_echo); }
    Ticket write = 0;
};

TEST_F(EchoInMidLife, P8ConfirmsNoWriteOfAPanelThatIsOff) {
    ask();
    hear_echo(bus);
    bus.run_for(2s);
    EXPECT_EQ(bus.answer(write).pdu.error(), Fault::timeout);
    EXPECT_TRUE(bus.answer(write).transmitted);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::present);
}

TEST_F(EchoInMidLife, P8ConfirmsNoWriteWhereTheReadIsAnsweredBehindAnEcho) {
    ask();
    hear_echo(bus);
    reply(bus, "03 02 00 03"_hex);
    EXPECT_EQ(bus.answer(write).pdu.error(), Fault::timeout);
}

TEST_F(EchoInMidLife, P8TheReplyBehindItConfirmsTheWrite) {
    reply(bus, kWrite);
    EXPECT_EQ(bus.answer(write).pdu.value(), kWrite);
    bus.run_for(200ms);
    bus.submit(17, kWrite);
    EXPECT_EQ(bus.sent.back().kind, FrameKind::learn_echo) << "nothing is known of the echo";
}

TEST_F(EchoInMidLife, P2AnAnswerThatWasJustQuickConfirmsTheWriteOnce) {
    ask();
    EXPECT_EQ(bus.sent.back().adu, encode_adu(17, "03 00 01 00 01"_hex)) << "what was written";
    answer(bus, 17, "03 02 00 03"_hex, 3ms);
    EXPECT_EQ(bus.answer(write).pdu.value(), kWrite);
    EXPECT_EQ(std::ranges::count(bus.sent, encode_adu(17, kWrite), &BusScript::Sent::adu), 1);
}

TEST_F(EchoInMidLife, P8WhereTheReadShowsAnotherValueOrNoneTheWriteIsNotConfirmed) {
    ask();
    answer(bus, 17, "03 02 00 04"_hex, 3ms);
    EXPECT_EQ(bus.answer(write).pdu.error(), Fault::timeout);
    EXPECT_TRUE(bus.answer(write).transmitted);
    bus.run_for(100ms);
    EXPECT_EQ(bus.sent.back().kind, FrameKind::learn_echo) << "P2: the write is not repeated";
    const Ticket other = bus.submit(17, kWrite);
    hear_echo(bus);
    ask();
    answer(bus, 17, "83 02"_hex, 3ms);
    EXPECT_EQ(bus.answer(other).pdu.error(), Fault::timeout);
}

inline const Bytes kLongWrite = "10 00 01 00 01 02 00 03"_hex;

TEST_F(EchoInMidLife, P2WhereLongWritesAreAnsweredWithoutTheirEchoAReadThatTellsNothingConfirms) {
    ask();
    answer(bus, 17, "83 02"_hex, 3ms);
    bus.run_for(100ms);
    const Ticket longer = bus.submit(17, kLongWrite);
    answer(bus, 17, "10 00 01 00 01"_hex, 3ms);
    ASSERT_TRUE(bus.answer(longer).pdu);
    bus.run_for(100ms);
    const Ticket quick = bus.submit(17, kWrite);
    hear_echo(bus);
    ask();
    answer(bus, 17, "83 02"_hex, 3ms);
    EXPECT_EQ(bus.answer(quick).pdu.value(), kWrite);
}

/// An adapter that echoes writes alone, as long after them as the panel takes to answer.
TEST_F(LearnedEcho, P8WhereALongWriteHasComeBackOneFrameConfirmsNoShortOne) {
    for (unsigned i = 0; i < RecentTimes::kEnough; ++i) read_once(bus, false);
    const Ticket longer = bus.submit(17, kLongWrite);
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    bus.hear(bus.sent.back().adu);
    bus.run_for(2s);
    ASSERT_EQ(bus.answer(longer).pdu.error(), Fault::timeout);
    read_once(bus, false);
    const Ticket write = bus.submit(17, kWrite);
    answer(bus, 17, kWrite, 3ms);
    EXPECT_FALSE(bus.answered(write));
    ASSERT_TRUE(bus.next_sent(600ms));
    answer(bus, 17, "03 02 00 00"_hex, 3ms);
    EXPECT_EQ(bus.answer(write).pdu.error(), Fault::timeout);
}

}  // namespace
}  // namespace panelgate::arbiter::echo_test
