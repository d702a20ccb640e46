// A panel's own bounds (T14), pauses inside a panel's replies (T4), and what a line needs.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::bounds_test {
namespace {

using modbus::encode_adu;

class BoundsTest : public ArbiterTest {
  protected:
    BoundsTest() {
        for (StationSettings& station : settings.stations) station.retries = 0;
    }
    StationSettings& panel() { return settings.stations[0]; }
};

TEST_F(BoundsTest, T14StationGapHoldsTheStationBehindItsReplyAndNobodyElse) {
    panel().station_gap = 300ms;
    BusScript line{settings};
    line.submit(17, read_at(1));
    answer(line, 17, reply_number(1), 3ms);
    const TimePoint replied = line.now();
    line.submit(17, read_at(2));
    line.submit(18, read_at(3), 2);
    ASSERT_EQ(line.next_sent().value().adu[0], 18);
    EXPECT_EQ(line.sent.back().at, replied + gap);
    answer(line, 18, reply_number(3), 3ms);
    EXPECT_EQ(line.next_sent().value().at, replied + 300ms);
    line.run_for(kSilence + 10ms);
    const std::size_t sent = line.sent.size();
    line.submit(17, kWrite);
    EXPECT_EQ(line.sent.size(), sent + 1) << "a silence is no reply";
}

TEST_F(BoundsTest, T14AfterWriteHoldsTheStationBehindAWriteAnsweredOrNot) {
    panel().after_write = 1s;
    for (const bool answered : {true, false}) {
        BusScript line{settings};
        line.submit(17, kWrite);
        line.run_to_end_of_request();
        if (answered) line.run_for(3ms), line.hear_reply(17, kWrite);
        if (!answered) line.run_for(kSilence);
        const TimePoint ended = line.now();
        line.submit(17, kRead);
        EXPECT_EQ(line.next_sent().value().at, ended + 1s) << answered;
    }
}

TEST_F(BoundsTest, T14AfterWriteHoldsBehindABroadcastToo) {
    panel().after_write = 1s;
    BusScript line{settings};
    line.submit(17, kRead);
    answer(line, 17, kReply, 3ms);
    line.run_for(10ms);
    line.submit(0, kWrite);
    line.run_to_end_of_request();
    const TimePoint left = line.now();
    line.submit(17, kRead);
    line.submit(18, kRead, 2);
    ASSERT_EQ(line.next_sent().value().adu[0], 18);
    answer(line, 18, kReply, 3ms);
    EXPECT_EQ(line.next_sent().value().at, left + 1s);
}

TEST_F(BoundsTest, T8ConnectPauseFollowsEachOpening) {
    settings.connect_pause = 2s;
    BusScript line{settings};
    const TimePoint opened = line.now() - 100ms;
    settings.queue.deadline = 10s;
    line.apply(settings);
    line.submit(17, kRead);
    EXPECT_EQ(line.next_sent().value().at, opened + 2s);
    line.line_down();
    line.run_for(1s);
    line.line_up();
    const TimePoint again = line.now();
    line.submit(18, kRead);
    EXPECT_EQ(line.next_sent().value().at, again + 2s);
}

/// The replies of station 17 may have any byte count.
class AnyLength : public BoundsTest {
  protected:
    AnyLength() { panel().any_length = true; }
    static Ticket ask(BusScript& line, const Bytes& pdu) {
        const auto request = test::request_of(pdu).with_any_length();
        return line.submit_job({.station = 17, .request = request, .client = 1});
    }
};

TEST_F(AnyLength, T14TheReplysOwnByteCountDecides) {
    BusScript line{settings};
    for (const Bytes& reply :
         {"03 0C 00 01 00 02 00 03 00 04 00 05 00 06"_hex, "03 02 00 01"_hex}) {
        const Ticket ticket = ask(line, kRead);
        answer(line, 17, reply, 3ms);
        EXPECT_EQ(line.answer(ticket).pdu.value(), reply);
        line.run_for(10ms);
    }
}

TEST_F(AnyLength, P1T2NoProofTellsAndTheWindowIsWaitedFor) {
    BusScript line{settings};
    ask(line, kRead);
    answer(line, 17, kReply, 3ms);
    line.run_for(10ms);
    const TimePoint asked = line.now();
    const Ticket missed = ask(line, read_at(1));
    while (!line.answered(missed)) line.run_for(1ms);
    const Ticket next = ask(line, read_at(2));
    EXPECT_GE(line.next_sent().value().at - asked, 1s);
    EXPECT_EQ(line.sent.back().adu, encode_adu(17, read_at(2)));
    answer(line, 17, kReply, 3ms);
    EXPECT_TRUE(line.answered(next));
}

/// Two adjacent reads wait while 18 is asked.
class JoinedRead : public BoundsTest {
  protected:
    JoinedRead() {
        line.submit(18, kRead, 9);
        first = line.submit(17, "03 00 0A 00 02"_hex, 1);
        second = line.submit(17, "03 00 0C 00 02"_hex, 2);
        answer(line, 18, kReply, 3ms);
        EXPECT_EQ(line.next_sent().value().adu, encode_adu(17, "03 00 0A 00 04"_hex));
    }
    BusScript line{settings};
    Ticket first = 0;
    Ticket second = 0;
};

TEST_F(JoinedRead, P6T14ThatIsRefusedIsSplit) {
    answer(line, 17, "83 02"_hex, 3ms);
    for (int i = 0; i < 2; ++i) {
        const std::uint8_t place = line.next_sent().value().adu[3];
        answer(line, 17, place == 0x0A ? "03 04 00 01 00 02"_hex : "03 04 00 03 00 04"_hex, 3ms);
    }
    EXPECT_EQ(line.answer(first).pdu.value(), "03 04 00 01 00 02"_hex);
    EXPECT_EQ(line.answer(second).pdu.value(), "03 04 00 03 00 04"_hex);
}

TEST_F(JoinedRead, P6T14ThatIsIgnoredIsSplitAndItsStationNotJudged) {
    line.run_for(kSilence + 3ms);
    EXPECT_FALSE(line.answered(first));
    EXPECT_EQ(line.arbiter().health(17).silent_in_a_row(), 0);
    for (int i = 0; i < 2; ++i) {
        while (line.sent.back().adu[5] == 4) ASSERT_TRUE(line.next_sent());
        answer(line, 17, "03 04 00 01 00 02"_hex, 3ms);
        if (i == 0) ASSERT_TRUE(line.next_sent());
    }
    EXPECT_TRUE(line.answer(first).pdu);
    EXPECT_TRUE(line.answer(second).pdu);
}

/// The panel's replies come in two halves with this pause between.
Result<Bytes> read_in_halves(BusScript& line, unsigned number, Duration pause) {
    const Ticket ticket = line.submit(17, read_at(number));
    while (!line.answered(ticket)) {
        const Bytes adu = encode_adu(17, reply_number(number));
        if (line.sent.back().adu[1] == 3 && line.sent.back().adu[5] == 3) {
            line.run_to_end_of_request();
            line.run_for(3ms);
            line.hear(ByteView(adu).first(6));
            line.run_for(pause);
            line.hear(ByteView(adu).subspan(6));
        }
        line.run_for(2s);
    }
    return line.answer(ticket).pdu;
}

TEST_F(BoundsTest, T4LengthDecidesAndAPauseIsWaitedForUpToReplyHole) {
    settings.learns_holes = false;
    BusScript line{settings};
    EXPECT_TRUE(read_in_halves(line, 1, settings.reply_hole - 1ms));
    for (unsigned i = 2; i < 9; ++i)
        EXPECT_EQ(read_in_halves(line, i, settings.reply_hole + 20ms).error(), Fault::damaged);
}

TEST_F(BoundsTest, T4ALongerPauseIsLearnedFromTwoRepliesInARow) {
    BusScript line{settings};
    for (unsigned i = 1; i < 9; ++i)
        EXPECT_EQ(read_in_halves(line, i, 150ms).has_value(), i > 2) << i;
}

TEST_F(BoundsTest, T14AddressesUpTo255AreAsked) {
    for (const std::uint8_t id : Bytes{248, 254, 255}) {
        const Ticket ticket = bus.submit(id, kRead);
        answer(bus, id, kReply, 3ms);
        EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
        bus.run_for(10ms);
    }
}

}  // namespace
}  // namespace panelgate::arbiter::bounds_test
