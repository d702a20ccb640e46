// Outstanding replies (T2, T8): no reply answers another request than its own, also across
// connections.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::arbiter_outstanding_test {
namespace {

using modbus::encode_adu;

const Bytes kOne = "03 00 00 00 01"_hex;
const Bytes kReplyOfOne = "03 02 00 07"_hex;

bool was_sent(const BusScript& bus, std::uint8_t station, const Bytes& pdu) {
    return std::ranges::count(bus.sent, encode_adu(station, pdu), &BusScript::Sent::adu) > 0;
}

/// Reads are not retried; 17 and 18 are known to answer reads of three registers.
class LateReply : public ArbiterTest {
  protected:
    LateReply() {
        for (StationSettings& station : settings.stations) station.retries = 0;
    }
    void start() {
        line.emplace(settings);
        for (const std::uint8_t station : Bytes{17, 18}) {
            line->submit(station, kRead);
            answer_next_or_last(station);
            line->run_for(10ms);
        }
    }
    void answer_next_or_last(std::uint8_t station) {
        if (line->sent.empty() || line->sent.back().adu[0] != station) line->next_sent();
        answer(*line, station, kReply, 3ms);
    }
    /// A read that is not answered in time.
    Ticket miss(const Bytes& pdu = read_at(1)) {
        const Ticket ticket = line->submit(17, pdu, 1);
        while (!line->answered(ticket)) line->run_for(1ms);
        EXPECT_EQ(line->answer(ticket).pdu.error(), Fault::timeout);
        return ticket;
    }
    std::optional<BusScript> line;
};

TEST_F(LateReply, P1OfTheSameFormAnswersNoRequestAndEndsTheRest) {
    line.emplace(settings);
    const Ticket first = line->submit(17, read_at(1), 1);
    const Ticket second = line->submit(17, read_at(2), 2);
    while (!line->answered(first)) line->run_for(1ms);
    line->run_for(300ms);
    line->hear_reply(17, reply_number(1));
    line->run_for(100ms);
    EXPECT_FALSE(line->answered(second));
    ASSERT_EQ(line->events.size(), 1u);
    EXPECT_EQ(line->events[0].kind, StationEvent::Kind::late);
    ASSERT_EQ(line->sent.size(), 2u);
    line->hear_reply(17, reply_number(2));
    EXPECT_EQ(line->answer(second).pdu.value(), reply_number(2));
}

TEST_F(LateReply, P1BeforeAnotherReadOfItsLengthAProofGoes) {
    start();
    miss();
    const Ticket next = line->submit(17, read_at(2), 1);
    const auto proof = line->next_sent(10ms).value_or(line->sent.back());
    EXPECT_EQ(proof.kind, FrameKind::probe);
    EXPECT_EQ(proof.adu, encode_adu(17, "03 00 6B 00 02"_hex));
    line->run_to_end_of_request();
    line->hear_reply(17, reply_number(1));  // late
    EXPECT_FALSE(line->answered(next));
    line->run_for(5ms);
    line->hear_reply(17, "03 04 00 01 00 02"_hex);
    ASSERT_EQ(line->next_sent(10ms).value().adu, encode_adu(17, read_at(2)));
    answer(*line, 17, reply_number(2), 3ms);
    EXPECT_EQ(line->answer(next).pdu.value(), reply_number(2));
}

TEST_F(LateReply, P4WhatNoOutstandingReplyCouldAnswerGoesAtOnce) {
    start();
    miss();
    const Ticket write = line->submit(17, kWrite, 1);
    ASSERT_EQ(line->sent.back().adu, encode_adu(17, kWrite));
    line->run_to_end_of_request();
    line->hear_reply(17, reply_number(1));  // late
    EXPECT_FALSE(line->answered(write));
    line->run_for(3ms);
    line->hear_reply(17, kWrite);
    EXPECT_EQ(line->answer(write).pdu.value(), kWrite);
    const Ticket other = line->submit(18, read_at(3), 2);
    answer_next(*line, 18, reply_number(3), 3ms);
    EXPECT_EQ(line->answer(other).pdu.value(), reply_number(3));
}

TEST_F(LateReply, P1BehindARetryThatWasAnsweredTheSecondReplyIsOutstanding) {
    settings.stations[0].retries = 1;
    start();
    const Ticket asked = line->submit(17, read_at(1), 1);
    ASSERT_EQ(line->next_sent().value().kind, FrameKind::retry);
    answer(*line, 17, reply_number(1), 3ms);  // perhaps of the first attempt
    ASSERT_TRUE(line->answered(asked));
    const Ticket next = line->submit(17, read_at(2), 1);
    EXPECT_EQ(line->next_sent(10ms).value().kind, FrameKind::probe);
    line->run_to_end_of_request();
    line->hear_reply(17, reply_number(1));
    EXPECT_FALSE(line->answered(next));
    EXPECT_EQ(line->events.back().kind, StationEvent::Kind::late);
    EXPECT_EQ(line->arbiter().station_counters().at(17).symptoms.late, 0u)
        << "in time for the retry";
}

TEST_F(LateReply, P1WhereTheWholeLineRestsAllWaitUntilNoLateReplyCanCome) {
    settings.quarantine = Quarantine::line;
    settings.stations[0].retries = 1;
    start();
    const Ticket silent = line->submit(17, kRead, 1);
    line->submit(18, kRead, 2);
    ASSERT_EQ(line->next_sent().value().adu[0], 17) << "the retry goes first";
    const auto next = line->next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->adu[0], 18);
    EXPECT_EQ(next->at - line->answer(silent).at, 2 * 500ms - kSilence);
}

TEST_F(LateReply, P1TheWholeLineRestsForAStationThatIsLateRegularly) {
    start();
    for (unsigned i = 0; i < 2; ++i) {
        miss(read_at(i));
        line->run_for(96ms);
        line->hear_reply(17, reply_number(i));
        line->run_for(20ms);
        line->submit(17, kRead);
        answer(*line, 17, kReply, 3ms);
        line->run_for(1s);
    }
    const TimePoint sent = line->now() + wire_time(settings.serial, 8);
    const Ticket silent = line->submit(17, read_at(7), 1);
    line->submit(18, kRead, 2);
    const auto next = line->next_sent();
    ASSERT_TRUE(line->answered(silent));
    const Duration late = next->at - sent - 500ms;
    EXPECT_GT(late, Duration(100ms)) << "a quarter longer than the replies were late";
    EXPECT_LT(late, Duration(160ms));
}

// Lines that may stall, and connections (T8)

TEST_F(ArbiterTest, P1RepliesOutstandingWhenTheLineWasLostAnswerNoRequestOfTheNextConnection) {
    bus.submit(17, read_at(1), 1);
    bus.run_to_end_of_request();
    bus.line_down();
    bus.line_up();
    const Ticket same = bus.submit(17, read_at(2), 2);
    const Ticket other = bus.submit(18, read_at(2), 3);
    ASSERT_EQ(bus.next_sent().value().adu[0], 18) << "other stations need not wait";
    answer(bus, 17, kReply);  // handed to the new connection
    EXPECT_FALSE(bus.answered(other));
    bus.run_for(30ms);
    bus.hear_reply(18, kReply);
    EXPECT_TRUE(bus.answered(other));
    EXPECT_FALSE(bus.answered(same));
    ASSERT_TRUE(bus.next_sent(10ms)) << "nothing is outstanding any more";
    EXPECT_EQ(bus.sent.back().adu[0], 17);
}

/// A tcp line. The station has answered a read of two registers and one of three, and then two
/// reads of three were not answered. The line was opened anew.
class StalledLine : public ArbiterTest {
  protected:
    StalledLine() {
        settings.may_stall = true;
        line.emplace(settings);
        read(kTwo, kReplyOfTwo);
        read(kRead, kReply);
        const Ticket first = line->submit(17, read_at(1), 1);
        while (!line->answered(first)) line->run_for(1ms);
        EXPECT_EQ(line->resets, 1);
        open_anew(2s);
    }
    void read(const Bytes& pdu, const Bytes& reply) {
        const Ticket ticket = line->submit(17, pdu);
        answer(*line, 17, reply, 3ms);
        EXPECT_TRUE(line->answered(ticket));
        line->run_for(20ms);
    }
    void open_anew(Duration wait) {
        line->line_down();
        line->line_up();
        line->run_for(wait);
    }
    void ask() {
        const std::size_t before = line->sent.size();
        second = line->submit(17, read_at(2), 1);
        if (line->sent.size() == before) line->next_sent();
        line->run_to_end_of_request();
    }
    bool second_was_sent() const { return was_sent(*line, 17, read_at(2)); }

    const Bytes kTwo = "03 00 6B 00 02"_hex;
    const Bytes kReplyOfTwo = "03 04 00 01 00 02"_hex;
    std::optional<BusScript> line;
    Ticket second = 0;
};

TEST_F(StalledLine, P1OutstandingRepliesDoNotLapseByTimeAlone) {
    line->run_for(60s);
    ask();
    EXPECT_EQ(line->sent.back().adu, encode_adu(17, kTwo)) << "a proof";
    EXPECT_FALSE(second_was_sent());
    line->hear_reply(17, reply_number(1));  // the server goes on: two late replies
    line->run_for(20ms);
    line->hear_reply(17, reply_number(1));
    line->run_for(20ms);
    EXPECT_FALSE(line->answered(second));
}

TEST_F(StalledLine, P1BehindAProofTheRequestRestsForAsLongAsAReplyMayTake) {
    ask();
    line->hear_reply(17, kReplyOfTwo);
    const TimePoint proved = line->now();
    line->run_for(900ms);
    EXPECT_FALSE(second_was_sent()) << "over two connections the order is unknown";
    ASSERT_TRUE(line->next_sent(500ms));
    EXPECT_TRUE(second_was_sent());
    EXPECT_GE(line->now() - proved, 990ms);
    answer(*line, 17, reply_number(2), 3ms);
    EXPECT_EQ(line->answer(second).pdu.value(), reply_number(2));
}

TEST_F(StalledLine, P1AnotherStationsReplyShowsThatTheWayIsOpen) {
    const Ticket other = line->submit(18, kRead, 2);
    answer(*line, 18, kReply, 3ms);
    ASSERT_TRUE(line->answered(other));
    const TimePoint told = line->now();
    second = line->submit(17, read_at(2), 1);
    EXPECT_FALSE(second_was_sent()) << "the stalled requests may have come to 17 only now";
    while (!second_was_sent()) ASSERT_TRUE(line->next_sent(2s));
    EXPECT_GE(line->now() - told, 900ms);
}

/// Nothing is heard over connection after connection.
class MuteLine : public ArbiterTest {
  protected:
    MuteLine() {
        settings.may_stall = true;
        settings.stations[0].retries = 0;
        settings.offline.after = 1000;
        line.emplace(settings);
    }
    /// A read is not answered. Where the arbiter asks for a new connection, the line is opened
    /// anew.
    void miss() {
        const Ticket ticket = line->submit(17, kRead);
        while (!line->answered(ticket)) {
            const int before = line->resets;
            line->run_for(1ms);
            if (line->resets == before) continue;
            reset_at.push_back(line->now());
            line->line_down();
            line->line_up();
        }
    }
    std::optional<BusScript> line;
    std::vector<TimePoint> reset_at;
};

TEST_F(MuteLine, T8ForSilenceAloneItIsOpenedAnewWithPausesThatDoubleUpToAMinute) {
    const TimePoint start = line->now();
    while (line->now() < start + 10min) miss();
    ASSERT_GT(reset_at.size(), 8u);
    EXPECT_LE(reset_at.front() - start, 510ms);
    for (std::size_t i = 2; i < reset_at.size(); ++i) {
        const Duration pause = reset_at[i] - reset_at[i - 1];
        const Duration before = reset_at[i - 1] - reset_at[i - 2];
        EXPECT_GE(pause, std::min<Duration>(2 * before - 2s, timing::kLongestReopen - 1ms)) << i;
        EXPECT_LE(pause, timing::kLongestReopen + 2s) << i;
    }
}

TEST_F(MuteLine, T8AConnectionThatHasBeenHeardIsOpenedAnewForTheSecondSilence) {
    line->submit(18, kRead);
    answer(*line, 18, kReply, 3ms);
    line->run_for(10ms);
    miss();
    EXPECT_EQ(line->resets, 0);
    miss();
    EXPECT_EQ(line->resets, 1);
    line->submit(18, kRead);
    if (line->sent.back().adu[0] != 18) line->next_sent();
    answer(*line, 18, kReply, 3ms);
    line->run_for(10ms);
    miss();
    miss();
    EXPECT_EQ(line->resets, 2) << "a reply ends the long pauses";
}

TEST_F(MuteLine, P3WhatWaitsWhenTheArbiterAsksForANewConnectionIsSentOverThatOne) {
    line->submit(18, kRead);
    answer(*line, 18, kReply, 3ms);
    line->run_for(10ms);
    miss();
    line->submit(17, kRead);
    while (line->resets == 0) line->run_for(1ms);
    const Ticket waits = line->submit(18, kRead, 2);
    line->line_down();
    EXPECT_FALSE(line->answered(waits));
    line->line_up();
    ASSERT_EQ(line->next_sent(100ms).value().adu[0], 18);
    answer(*line, 18, kReply, 3ms);
    EXPECT_TRUE(line->answer(waits).pdu);
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_outstanding_test
