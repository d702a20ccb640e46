#include "panelgate/arbiter/arbiter.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <variant>

#include "panelgate/modbus/exception.hpp"
#include "support/bus_script.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter {
namespace {

using test::BusScript;

const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
const Bytes kWrite = "06 00 01 00 03"_hex;

/// A read of three registers that touches no other one with another number.
Bytes read_at(unsigned number) { return Writer().u8(3).u16(100 * number).u16(3).take(); }

/// Three registers, other ones each time.
Bytes reply_number(std::size_t number) {
    return Writer().u8(3).u8(6).u16(static_cast<unsigned>(number)).u16(2).u16(3).take();
}

Settings settings_38400() {
    Settings settings;
    settings.serial = {38400, 8, Parity::none, 1};
    settings.unlisted.response_timeout = 500ms;
    settings.unlisted.retries = 1;
    settings.unlisted.vouched = true;
    settings.stations = {settings.unlisted, settings.unlisted};
    settings.stations[0].id = 17;
    settings.stations[1].id = 18;
    return settings;
}

class ArbiterTest : public testing::Test {
  protected:
    Settings settings = settings_38400();
    BusScript bus{settings};
    Duration gap = silent_interval(settings.serial);
};

TEST_F(ArbiterTest, HandsTheReplyOnAtItsLastByte) {
    const Ticket ticket = bus.submit(17, kRead);
    ASSERT_EQ(bus.sent.size(), 1u);
    EXPECT_EQ(bus.sent[0].adu, "11 03 00 6B 00 03 76 87"_hex);
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    const Bytes adu = modbus::encode_adu(17, kReply);
    bus.hear_paced(ByteView(adu).first(adu.size() - 1));
    EXPECT_FALSE(bus.answered(ticket));
    bus.hear_paced(ByteView(adu).last(1));
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(bus.answer(ticket).at, bus.now());
}

TEST_F(ArbiterTest, SendsTheNextRequestExactlyAtTheGap) {
    bus.submit(17, kRead, 1);
    bus.submit(18, kRead, 2);
    bus.run_to_end_of_request();
    bus.run_for(2ms);
    bus.hear_reply(17, kReply);
    const TimePoint last_byte = bus.now();
    const auto next = bus.next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->adu[0], 18);
    EXPECT_EQ(next->at - last_byte, gap);
}

TEST_F(ArbiterTest, CountsTheTimeoutFromTheEndOfTheRequestOnTheWire) {
    settings.unlisted.retries = 0;
    settings.stations.clear();
    BusScript script{settings};
    const Ticket ticket = script.submit(17, kRead);
    const TimePoint end = script.now() + wire_time(settings.serial, 8);
    script.run_until(end + 500ms - 1us);
    EXPECT_FALSE(script.answered(ticket));
    script.run_until(end + 500ms);
    ASSERT_TRUE(script.answered(ticket));
    EXPECT_EQ(script.answer(ticket).pdu.error(), Fault::timeout);
    EXPECT_TRUE(script.answer(ticket).transmitted);
}

TEST_F(ArbiterTest, GivesUpASilentStationAfterTimeoutTimesRetriesPlusOne) {
    const Ticket ticket = bus.submit(17, kRead);
    const TimePoint start = bus.now();
    bus.run_for(5s);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    EXPECT_EQ(bus.sent.size(), 2u);
    EXPECT_EQ(bus.answer(ticket).at - start, 2 * (500ms + wire_time(settings.serial, 8)));
    EXPECT_EQ(bus.arbiter().station_counters().at(17).retries, 1u);
}

TEST_F(ArbiterTest, P2NeverRepeatsAWrite) {
    for (const Bytes& write :
         {kWrite, "05 00 01 FF 00"_hex, "10 00 01 00 01 02 00 03"_hex, "0F 00 01 00 01 01 01"_hex,
          "16 00 04 00 F2 00 25"_hex, "17 00 03 00 01 00 0E 00 01 02 00 FF"_hex, "41 01 02"_hex}) {
        BusScript script{settings};
        const Ticket ticket = script.submit(17, write);
        script.run_for(5s);
        EXPECT_EQ(script.sent.size(), 1u) << to_hex(write);
        EXPECT_EQ(script.answer(ticket).pdu.error(), Fault::timeout);
        EXPECT_TRUE(script.answer(ticket).transmitted);
    }
}

TEST_F(ArbiterTest, RepeatsAWriteWhenTheStationSaysSo) {
    settings.stations[0].retry_writes = true;
    BusScript script{settings};
    script.submit(17, kWrite);
    script.run_for(5s);
    EXPECT_EQ(script.sent.size(), 2u);
}

TEST_F(ArbiterTest, OtherStationsAreAskedBetweenTheAttemptsWhenOnlyTheStationIsQuarantined) {
    settings.quarantine = Quarantine::station;
    BusScript script{settings};
    script.submit(17, kRead, 1);
    const Ticket other = script.submit(18, kRead, 2);
    const auto second = script.next_sent();
    ASSERT_TRUE(second);
    EXPECT_EQ(second->adu[0], 18);
    script.run_to_end_of_request();
    script.hear_reply(18, kReply);
    EXPECT_TRUE(script.answered(other));
    EXPECT_EQ(script.next_sent()->adu[0], 17);
}

TEST_F(ArbiterTest, P1WhereTheLineRestsAllWaitUntilALateReplyCanNoLongerCome) {
    settings.quarantine = Quarantine::line;
    BusScript script{settings};
    const Ticket silent = script.submit(17, kRead, 1);
    const Ticket other = script.submit(18, kRead, 2);
    ASSERT_EQ(script.next_sent()->adu[0], 17);  // its retry comes first
    const auto next = script.next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->adu[0], 18);
    ASSERT_TRUE(script.answered(silent));
    EXPECT_EQ(next->at - script.answer(silent).at, 500ms);
    script.run_to_end_of_request();
    script.hear_reply(18, kReply);
    EXPECT_EQ(script.answer(other).pdu.value(), kReply);
}

TEST_F(ArbiterTest, P1ALateReplyOfTheSameShapeAnswersNobodyAndEndsTheRest) {
    settings.stations[0].retries = 0;
    BusScript script{settings};
    const Ticket first = script.submit(17, read_at(1), 1);
    const Ticket second = script.submit(17, read_at(2), 2);
    while (!script.answered(first)) script.run_for(1ms);
    script.run_for(300ms);
    script.hear_reply(17, kReply);  // of the first: same station, function and length
    script.run_for(100ms);
    EXPECT_FALSE(script.answered(second));
    EXPECT_EQ(script.events.size(), 1u);
    EXPECT_EQ(script.events[0].kind, StationEvent::Kind::late);
    ASSERT_EQ(script.sent.size(), 2u);
    script.hear_reply(17, "03 06 00 01 00 02 00 03"_hex);
    EXPECT_EQ(script.answer(second).pdu.value(), "03 06 00 01 00 02 00 03"_hex);
}

TEST_F(ArbiterTest, P1BytesBeforeAReplyCouldHaveBegunAreStaleOnARealLine) {
    settings.paced = true;
    BusScript script{settings};
    const Ticket ticket = script.submit(17, kRead);
    script.run_for(1ms);  // the request is still leaving
    script.hear_reply(17, kReply);
    script.run_for(30ms);
    EXPECT_FALSE(script.answered(ticket));
    script.hear_reply(17, "03 06 00 01 00 02 00 03"_hex);
    EXPECT_EQ(script.answer(ticket).pdu.value(), "03 06 00 01 00 02 00 03"_hex);
}

TEST_F(ArbiterTest, ALineWithoutARealPaceIsLearned) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.hear_reply(17, kReply);  // a pty answers before the computed end of the request
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
}

TEST_F(ArbiterTest, P5OnALineThatIsQuickerThanItsRateTheGapFollowsTheReply) {
    for (unsigned i = 0; i < 6; ++i) bus.submit(17, read_at(i));
    std::vector<TimePoint> replied;
    for (std::size_t i = 0; i < 6; ++i) {
        ASSERT_EQ(bus.sent.size(), i + 1);
        bus.run_for(100us);
        bus.hear_reply(17, reply_number(i));
        replied.push_back(bus.now());
        bus.next_sent();
    }
    const Duration leaving = wire_time(settings.serial, 8);
    EXPECT_EQ(bus.sent[1].at, bus.sent[0].at + leaving + gap) << "one may have been a late one";
    EXPECT_EQ(bus.sent[4].at, replied[3] + gap);
    EXPECT_EQ(bus.sent[5].at, replied[4] + gap);
}

TEST_F(ArbiterTest, P4AfterThreeSilentTransactionsTheAnswerIsImmediate) {
    for (int i = 0; i < 3; ++i) {
        const Ticket ticket = bus.submit(17, kRead);
        bus.run_for(3s);
        EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    }
    EXPECT_EQ(bus.arbiter().health(17).state(), StationHealth::State::offline);
    const std::size_t frames = bus.sent.size();
    EXPECT_EQ(bus.try_submit(17, kRead).error(), Fault::offline);
    EXPECT_EQ(bus.sent.size(), frames);
}

/// Takes station 17 offline.
void silence(BusScript& bus) {
    while (!bus.arbiter().health(17).offline()) {
        if (bus.arbiter().idle()) bus.submit(17, kRead, 7);
        bus.run_for(100ms);
    }
}

TEST_F(ArbiterTest, P4QueuedRequestsOfAStationThatGoesOfflineAreAnsweredAtOnce) {
    settings.queue.deadline = 60s;
    BusScript script{settings};
    std::vector<Ticket> tickets;
    for (unsigned i = 0; i < 6; ++i) tickets.push_back(script.submit(17, read_at(i), i + 1));
    while (!script.arbiter().health(17).offline()) script.run_for(10ms);
    for (const Ticket ticket : tickets) EXPECT_TRUE(script.answered(ticket));
    EXPECT_EQ(script.answer(tickets[5]).pdu.error(), Fault::offline);
    EXPECT_FALSE(script.answer(tickets[5]).transmitted);
}

TEST_F(ArbiterTest, P4ProbesOfASilentStationStayBelowTheirShareAndOneReplyBringsItBack) {
    silence(bus);
    const std::size_t before = bus.sent.size();
    const Duration busy = bus.arbiter().counters().busy;
    bus.run_for(1000s);
    EXPECT_GT(bus.sent.size(), before + 10) << "it is asked again and again";
    EXPECT_LT(to_seconds(bus.arbiter().counters().busy - busy), 0.05 * 1000);
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.arbiter().health(17).state(), StationHealth::State::online);
    const Ticket ticket = bus.submit(17, kRead);
    ASSERT_TRUE(bus.next_sent(1s));
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    EXPECT_TRUE(bus.answer(ticket).pdu.has_value());
}

TEST_F(ArbiterTest, P4AProbeOfAStationWhosePaceIsKnownIsShort) {
    bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.run_for(4ms);
    bus.hear_reply(17, kReply);
    silence(bus);
    ASSERT_TRUE(bus.next_sent(60s));
    const Ticket other = bus.submit(18, kRead);
    const TimePoint asked = bus.now();
    ASSERT_TRUE(bus.next_sent());
    EXPECT_EQ(bus.sent.back().adu[0], 18);
    EXPECT_LT(bus.now() - asked, 50ms);
    EXPECT_FALSE(bus.answered(other));
}

TEST_F(ArbiterTest, P4AWriteMayBeTheProbeOnceAnInterval) {
    bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    bus.hear_reply(17, kReply);
    silence(bus);
    bus.run_for(20s);
    EXPECT_EQ(bus.try_submit(17, kRead).error(), Fault::offline);
    const Ticket write = bus.submit(17, kWrite);
    EXPECT_EQ(bus.try_submit(17, kWrite).error(), Fault::offline);
    while (bus.sent.back().adu[1] != 6) ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    bus.hear_reply(17, kWrite);
    EXPECT_EQ(bus.answer(write).pdu.value(), kWrite);
    EXPECT_EQ(bus.arbiter().health(17).state(), StationHealth::State::online);
}

TEST_F(ArbiterTest, P4ADamagedReplyIsNotSilence) {
    for (int i = 0; i < 5; ++i) {
        bus.submit(17, kRead);
        for (int attempt = 0; attempt < 2; ++attempt) {
            if (attempt > 0 || bus.sent.empty() || bus.now() >= bus.sent.back().at + 10ms) {
                ASSERT_TRUE(attempt == 0 || bus.next_sent());
            }
            bus.run_to_end_of_request();
            bus.hear(ByteView(modbus::encode_adu(17, kReply)).first(6));
        }
        bus.run_for(30ms);
    }
    EXPECT_FALSE(bus.arbiter().health(17).offline());
}

TEST_F(ArbiterTest, P6IdenticalReadsShareOneTransaction) {
    bus.submit(18, kRead, 99);
    std::vector<Ticket> tickets;
    for (Client client = 1; client <= 8; ++client) tickets.push_back(bus.submit(17, kRead, client));
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    for (const Ticket ticket : tickets) EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    bus.run_for(5s);
    EXPECT_EQ(bus.sent.size(), 2u);
}

TEST_F(ArbiterTest, P6OneMayJoinWhileTheRequestLeavesButNotLater) {
    settings.paced = true;
    BusScript uart{settings};
    uart.submit(17, kRead, 1);
    uart.run_for(1ms);
    const Ticket joined = uart.submit(17, kRead, 2);
    uart.run_to_end_of_request();
    const Ticket late = uart.submit(17, kRead, 3);
    uart.run_for(3ms);
    uart.hear_reply(17, kReply);
    EXPECT_TRUE(uart.answered(joined));
    EXPECT_FALSE(uart.answered(late)) << "its value would have been sampled before it asked";
    EXPECT_TRUE(uart.next_sent());
}

TEST_F(ArbiterTest, P6NobodyJoinsWhatAFarEndMayHaveAlready) {
    bus.submit(17, kRead, 1);
    const Ticket late = bus.submit(17, kRead, 2);
    bus.hear_reply(17, kReply);
    EXPECT_FALSE(bus.answered(late)) << "the far end of a tcp line has the request at once";
}

TEST_F(ArbiterTest, P6TouchingReadsAreJoinedAndContainedOnesSliced) {
    bus.submit(18, kRead, 99);
    const Ticket a = bus.submit(17, "03 00 0A 00 02"_hex, 1);
    const Ticket b = bus.submit(17, "03 00 0C 00 01"_hex, 2);
    const Ticket c = bus.submit(17, "03 00 0B 00 01"_hex, 3);
    const Ticket apart = bus.submit(17, "03 00 0E 00 01"_hex, 4);
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_TRUE(bus.next_sent());
    EXPECT_EQ(bus.sent.back().adu, modbus::encode_adu(17, "03 00 0A 00 03"_hex));
    bus.run_to_end_of_request();
    bus.hear_reply(17, "03 06 00 01 00 02 00 03"_hex);
    EXPECT_EQ(bus.answer(a).pdu.value(), "03 04 00 01 00 02"_hex);
    EXPECT_EQ(bus.answer(b).pdu.value(), "03 02 00 03"_hex);
    EXPECT_EQ(bus.answer(c).pdu.value(), "03 02 00 02"_hex);
    EXPECT_FALSE(bus.answered(apart));
}

TEST_F(ArbiterTest, P6BitsAreSlicedToo) {
    bus.submit(18, kRead, 99);
    const Ticket a = bus.submit(17, "01 00 03 00 0A"_hex, 1);
    const Ticket b = bus.submit(17, "01 00 0D 00 05"_hex, 2);
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.hear_reply(17, "01 02 CD 6B"_hex);  // bits 3..17, the sixteenth is padding
    EXPECT_EQ(bus.answer(a).pdu.value(), "01 02 CD 03"_hex);
    EXPECT_EQ(bus.answer(b).pdu.value(), "01 01 1A"_hex);
}

TEST_F(ArbiterTest, P6AJoinThatThePanelRefusesIsSplitAndRemembered) {
    bus.submit(18, kRead, 99);
    const Ticket a = bus.submit(17, "03 00 0A 00 02"_hex, 1);
    const Ticket b = bus.submit(17, "03 00 0C 00 02"_hex, 2);
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.hear_reply(17, "83 02"_hex);
    EXPECT_FALSE(bus.answered(a));
    for (int i = 0; i < 2; ++i) {
        ASSERT_TRUE(bus.next_sent());
        bus.run_to_end_of_request();
        const bool first_half = bus.sent.back().adu[3] == 0x0A;
        bus.hear_reply(17, first_half ? "03 04 00 01 00 02"_hex : "83 02"_hex);
    }
    EXPECT_EQ(bus.answer(a).pdu.value(), "03 04 00 01 00 02"_hex);
    EXPECT_EQ(bus.answer(b).pdu.value(), "83 02"_hex);
    bus.submit(18, kRead, 99);
    bus.submit(17, "03 00 0A 00 02"_hex, 1);
    bus.submit(17, "03 00 0C 00 02"_hex, 2);
    ASSERT_TRUE(bus.sent.back().adu[0] == 18 || bus.next_sent());
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_TRUE(bus.next_sent());
    EXPECT_EQ(bus.sent.back().adu, modbus::encode_adu(17, "03 00 0A 00 02"_hex));
}

TEST_F(ArbiterTest, P6AClientNeverReadsOlderThanItsOwnWrite) {
    bus.submit(18, kRead, 99);
    const Ticket others = bus.submit(17, kRead, 1);
    bus.submit(17, "06 00 6B 00 07"_hex, 2, PriorityClass::write);
    const Ticket own = bus.submit(17, kRead, 2);
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_EQ(bus.next_sent()->adu[1], 6);
    bus.run_to_end_of_request();
    bus.hear_reply(17, "06 00 6B 00 07"_hex);
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    EXPECT_TRUE(bus.answered(others));
    EXPECT_TRUE(bus.answered(own)) << "after the write it may share";
    EXPECT_EQ(bus.sent.size(), 3u);
}

TEST_F(ArbiterTest, P9WhatHasWaitedLongGoesAheadButAWriteStartsWithinTwoTransactions) {
    settings.queue.deadline = 60s;
    BusScript script{settings};
    script.submit(18, kRead, 99);
    const Ticket poll = script.submit(17, read_at(1), 1, PriorityClass::poll);
    for (unsigned i = 0; i < 200 && !script.answered(poll); ++i) {
        if (i % 2 == 0) script.submit(17, read_at(2 + i), 2);
        if (script.arbiter().queue_depth() < 8) script.submit(17, kWrite, 3, PriorityClass::write);
        script.run_to_end_of_request();
        script.run_for(10ms);
        const Bytes request(script.sent.back().adu.begin() + 1, script.sent.back().adu.end() - 2);
        script.hear_reply(script.sent.back().adu[0], request[0] == 6 ? request : kReply);
        ASSERT_TRUE(script.next_sent());
    }
    EXPECT_TRUE(script.answered(poll));
}

TEST_F(ArbiterTest, ClientsTakeTurns) {
    bus.submit(18, read_at(9), 9);  // keeps the line busy while the others queue
    for (unsigned i = 0; i < 3; ++i) bus.submit(17, read_at(i), 1);
    bus.submit(18, kRead, 2);
    std::vector<int> order;
    while (order.size() < 4) {
        bus.run_to_end_of_request();
        bus.hear_reply(bus.sent.back().adu[0], reply_number(order.size()));
        ASSERT_TRUE(bus.next_sent());
        order.push_back(bus.sent.back().adu[0]);
    }
    EXPECT_EQ(order, (std::vector<int>{17, 18, 17, 17}));
}

TEST_F(ArbiterTest, P9WritesGoBeforeReadsOfOtherClients) {
    bus.submit(17, kRead, 1);
    bus.submit(17, kRead, 2);
    bus.submit(18, kWrite, 3, PriorityClass::write);
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.next_sent()->adu[1], 0x06);
}

TEST_F(ArbiterTest, BroadcastIsAnsweredWhenItHasLeftAndTheLineRestsForTheTurnaround) {
    const Ticket broadcast = bus.submit(0, kWrite, 1, PriorityClass::write);
    bus.submit(17, kRead, 2);
    const TimePoint end = bus.now() + wire_time(settings.serial, 8);
    bus.run_until(end);
    ASSERT_TRUE(bus.answered(broadcast));
    EXPECT_EQ(bus.answer(broadcast).pdu.value(), kWrite);
    const auto next = bus.next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->at - end, 100ms);
    EXPECT_EQ(bus.arbiter().counters().broadcasts, 1u);
}

TEST_F(ArbiterTest, P3ABroadcastIsNotConfirmedBehindItsDeadlineWhenTheProcessStoodStill) {
    Arbiter arbiter(settings);
    const TimePoint start{1h};
    arbiter.on_line_up(start);
    const Job job{
        .request = test::request_of(kWrite), .client = 1, .priority = PriorityClass::write};
    const TimePoint free = start + 1s;
    arbiter.on_deadline(free);
    ASSERT_TRUE(arbiter.submit(free, job));
    arbiter.on_deadline(free + settings.queue.deadline + 1s);
    int answers = 0;
    while (auto action = arbiter.poll_action()) {
        const auto* finish = std::get_if<Finish>(&*action);
        if (finish == nullptr) continue;
        ++answers;
        EXPECT_EQ(finish->pdu.error(), Fault::timeout);
    }
    EXPECT_EQ(answers, 1);
}

TEST_F(ArbiterTest, BroadcastOfSeveralIsAnsweredWithAddressAndQuantity) {
    const Ticket ticket = bus.submit(0, "10 00 64 00 02 04 00 0A 01 02"_hex);
    bus.run_for(1s);
    EXPECT_EQ(bus.sent.size(), 1u);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), "10 00 64 00 02"_hex);
}

TEST_F(ArbiterTest, AReplyToABroadcastIsCountedAndGivenToNobody) {
    const Ticket broadcast = bus.submit(0, kWrite);
    const Ticket read = bus.submit(17, kRead, 2);
    bus.run_to_end_of_request();
    bus.run_for(10ms);
    bus.hear_reply(17, kReply);
    EXPECT_TRUE(bus.answered(broadcast));
    EXPECT_FALSE(bus.answered(read));
}

TEST_F(ArbiterTest, P4ASilenceWhoseRetryNobodyWaitsForCountsAllTheSame) {
    bus.submit(17, read_at(1), 1);
    ASSERT_EQ(bus.sent.size(), 1u);
    bus.submit(18, read_at(2), 2);
    ASSERT_TRUE(bus.next_sent());
    ASSERT_EQ(bus.sent.back().adu[0], 18) << "another one goes first";
    EXPECT_EQ(bus.arbiter().health(17).silent_in_a_row(), 0);
    bus.cancel(1);
    EXPECT_EQ(bus.arbiter().health(17).silent_in_a_row(), 1);
}

/// It repeats another one, so it waits for what else may come; meanwhile the process stands still.
TEST_F(ArbiterTest, P3AReplyThatWasHeldBackIsNotGivenToWhomItIsTooLateFor) {
    bus.submit(17, read_at(1));
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    bus.hear_reply(17, kReply);
    const Ticket second = bus.submit(17, read_at(2));
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    bus.hear_reply(17, kReply);
    ASSERT_FALSE(bus.answered(second));
    bus.arbiter().on_deadline(bus.now() + settings.queue.deadline);
    std::optional<Finish> answer;
    while (auto action = bus.arbiter().poll_action()) {
        if (const auto* finish = std::get_if<Finish>(&*action)) answer = *finish;
    }
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->ticket, second);
    ASSERT_FALSE(answer->pdu);
    EXPECT_EQ(answer->pdu.error(), Fault::timeout);
}

TEST_F(ArbiterTest, P3ExpiresWhatCannotFinishBeforeItsDeadlineWithoutTouchingTheWire) {
    settings.queue.deadline = 400ms;
    BusScript script{settings};
    const Ticket first = script.submit(17, kRead, 1);
    const Ticket second = script.submit(18, kRead, 2);
    const TimePoint start = script.now();
    script.run_for(1s);
    // The first is cut at its deadline, the second was never started.
    EXPECT_EQ(script.answer(first).pdu.error(), Fault::timeout);
    EXPECT_EQ(script.answer(first).at - start, 400ms);
    EXPECT_EQ(script.answer(second).pdu.error(), Fault::expired);
    EXPECT_FALSE(script.answer(second).transmitted);
    EXPECT_LT(script.answer(second).at - start, 400ms);
    EXPECT_EQ(script.sent.size(), 1u);
}

TEST_F(ArbiterTest, P9RefusesAtOnceWhenAQueueIsFull) {
    settings.queue.limit = 4;
    settings.queue.per_client = 2;
    BusScript script{settings};
    script.submit(17, read_at(1), 1);  // on the wire: does not count
    script.submit(17, read_at(2), 1);
    script.submit(17, read_at(3), 1);
    EXPECT_EQ(script.try_submit(17, read_at(4), 1).error(), Fault::busy);
    script.submit(17, read_at(5), 2);
    script.submit(17, read_at(6), 2);
    EXPECT_EQ(script.arbiter().queue_depth(), 4u);
    script.submit(17, read_at(7), 3);
    ASSERT_EQ(script.answers.size(), 1u) << "who has most makes room";
    EXPECT_EQ(script.answers.begin()->second.pdu.error(), Fault::busy);
    EXPECT_EQ(script.try_submit(17, read_at(8), 3).error(), Fault::busy);
    EXPECT_EQ(script.arbiter().queue_depth(), 4u);
}

TEST_F(ArbiterTest, P2ACancelledClientsQueueNeverReachesTheWire) {
    const Ticket on_wire = bus.submit(17, kRead, 1);
    const Ticket queued = bus.submit(17, kWrite, 1);
    bus.cancel(1);
    EXPECT_EQ(bus.answer(queued).pdu.error(), Fault::cancelled);
    EXPECT_FALSE(bus.answer(queued).transmitted);
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(on_wire).pdu.value(), kReply);
    bus.run_for(5s);
    EXPECT_EQ(bus.sent.size(), 1u);
}

TEST_F(ArbiterTest, AForeignFrameIsSteppedOverAndDoesNotExtendTheDeadline) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.run_for(5ms);
    bus.hear_reply(18, kReply);
    bus.run_for(40ms);
    EXPECT_FALSE(bus.answered(ticket));
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).foreign_frames, 1u);
}

TEST_F(ArbiterTest, P1AStationThatSaysItsRepliesTwiceIsLeftAloneUntilTheSecondHasPassed) {
    const auto ask = [&](Client client) {
        bus.submit(17, kRead, client);
        bus.run_to_end_of_request();
        bus.run_for(3ms);
        bus.hear_reply(17, kReply);
        return bus.now();
    };
    ask(1);
    bus.run_for(80ms);
    bus.hear_reply(17, kReply);  // the copy
    bus.run_for(200ms);
    const TimePoint replied = ask(1);
    bus.submit(17, read_at(5), 1);
    bus.submit(18, kRead, 2);
    EXPECT_EQ(bus.next_sent()->adu[0], 18) << "the others need not wait";
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    bus.hear_reply(18, kReply);
    const auto next = bus.next_sent();
    ASSERT_TRUE(next);
    EXPECT_GE(next->at - replied, Duration(120ms));
}

TEST_F(ArbiterTest, P1AReplyOfAnotherLengthIsNotTaken) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear_reply(17, "03 0A 00 01 00 02 00 03 00 04 00 05"_hex);
    EXPECT_FALSE(bus.answered(ticket));
    ASSERT_TRUE(bus.next_sent(2 * gap)) << "it said something else: nobody waits any longer";
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).foreign_frames, 1u);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).late_frames, 0u);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).symptoms.wrong, 1u);
}

TEST_F(ArbiterTest, ADamagedReplyIsRetriedAfterSilenceAndCounted) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    Bytes adu = modbus::encode_adu(17, kReply);
    adu[4] ^= 1;
    bus.hear(adu);
    const TimePoint damaged_at = bus.now();
    const auto again = bus.next_sent();
    ASSERT_TRUE(again);
    EXPECT_EQ(again->at - damaged_at, 20ms);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).damaged_frames, 1u);
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
}

TEST_F(ArbiterTest, OnlyDamagedRepliesEndAsDamaged) {
    const Ticket ticket = bus.submit(17, kRead);
    for (int i = 0; i < 2; ++i) {
        bus.run_to_end_of_request();
        bus.hear(ByteView(modbus::encode_adu(17, kReply)).first(6));
        bus.run_for(510ms);  // how long it needs is not known yet: the rest may come
    }
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::damaged);
    EXPECT_EQ(bus.arbiter().health(17).silent_in_a_row(), 0);
}

TEST_F(ArbiterTest, APanelsExceptionIsFinal) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.hear_reply(17, "83 06"_hex);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), "83 06"_hex);
    bus.run_for(5s);
    EXPECT_EQ(bus.sent.size(), 1u);
    EXPECT_EQ(bus.arbiter().station_counters().at(17).exceptions.at(6), 1u);
}

TEST_F(ArbiterTest, AReplyThatHasBegunInTimeIsHeardToItsEnd) {
    settings.serial.baud = 1200;
    settings.unlisted.response_timeout = 1s;
    settings.stations.clear();
    settings.queue.deadline = 10s;
    BusScript script{settings};
    const Ticket ticket = script.submit(17, "03 00 00 00 7D"_hex);
    script.run_to_end_of_request();
    script.run_for(990ms);
    Bytes pdu{0x03, 250};
    pdu.resize(252, 0x5A);
    script.hear_paced(modbus::encode_adu(17, pdu));  // 2.1 s on the wire
    ASSERT_TRUE(script.answered(ticket));
    EXPECT_EQ(script.answer(ticket).pdu.value(), pdu);
}

TEST_F(ArbiterTest, PausesUpToTheEndOfFrameTimeInsideAReplyAreNoError) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    const Bytes adu = modbus::encode_adu(17, kReply);
    for (const std::uint8_t& b : adu) {
        bus.run_for(15ms);
        bus.hear(ByteView(&b, 1));
    }
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(bus.sent.size(), 1u);
}

TEST_F(ArbiterTest, AReplyWithoutAKnownLengthEndsWithSilence) {
    const Ticket ticket = bus.submit(17, "41 DE AD"_hex);
    bus.run_to_end_of_request();
    bus.hear("11 41 DE AD CD 11"_hex);  // a CRC that is right in mid-frame must not end it
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_for(1ms);
    bus.hear("00 11 22 33 08 B0"_hex);
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_for(20ms);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), "41 DE AD CD 11 00 11 22 33"_hex);
}

TEST_F(ArbiterTest, TheLongerGapOfAStationIsKept) {
    settings.stations[1].frame_gap = 40ms;
    BusScript script{settings};
    script.submit(17, read_at(1), 1);
    script.submit(18, kRead, 2);
    script.submit(17, read_at(2), 1);
    script.run_to_end_of_request();
    script.hear_reply(17, kReply);
    TimePoint last = script.now();
    EXPECT_EQ(script.next_sent()->at - last, 40ms);
    script.run_to_end_of_request();
    script.hear_reply(18, kReply);
    last = script.now();
    EXPECT_EQ(script.next_sent()->at - last, 40ms);
}

TEST_F(ArbiterTest, P7ALostLineAnswersEverythingAtOnce) {
    const Ticket on_wire = bus.submit(17, kRead, 1);
    const Ticket queued = bus.submit(17, kWrite, 2);
    bus.line_down();
    EXPECT_EQ(bus.answer(on_wire).pdu.error(), Fault::line_lost);
    EXPECT_TRUE(bus.answer(on_wire).transmitted);
    EXPECT_EQ(bus.answer(queued).pdu.error(), Fault::line_down);
    EXPECT_FALSE(bus.answer(queued).transmitted);
    EXPECT_EQ(bus.try_submit(17, kRead).error(), Fault::line_down);
    bus.line_up();
    bus.run_for(1100ms);
    EXPECT_EQ(bus.sent.size(), 1u) << "nothing is sent again after a lost line";
    bus.submit(17, kRead);
    EXPECT_EQ(bus.sent.size(), 2u);
}

TEST_F(ArbiterTest, P1WhatWasOwedWhenTheLineWasLostAnswersNobodyWhenItIsBack) {
    bus.submit(17, read_at(1), 1);
    bus.run_to_end_of_request();
    bus.line_down();
    bus.line_up();
    const Ticket same = bus.submit(17, read_at(2), 2);
    const Ticket other = bus.submit(18, read_at(2), 3);
    ASSERT_TRUE(bus.next_sent());
    EXPECT_EQ(bus.sent.back().adu[0], 18) << "others need not wait";
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);  // handed to the new connection
    EXPECT_FALSE(bus.answered(other));
    bus.run_for(30ms);
    bus.hear_reply(18, kReply);
    EXPECT_TRUE(bus.answered(other));
    EXPECT_FALSE(bus.answered(same));
    ASSERT_TRUE(bus.next_sent(10ms)) << "nothing is owed any more";
    EXPECT_EQ(bus.sent.back().adu[0], 17);
}

TEST_F(ArbiterTest, UnaskedBytesPostponeTheNextRequest) {
    bus.hear("00 11 22"_hex);
    const TimePoint heard = bus.now();
    bus.submit(17, kRead);
    const auto sent = bus.next_sent();
    ASSERT_TRUE(sent);
    EXPECT_EQ(sent->at - heard, gap);
}

TEST_F(ArbiterTest, EarlyAndRepeatedDeadlineCallsAreHarmless) {
    const Ticket ticket = bus.submit(17, kRead);
    for (int i = 0; i < 1000; ++i) bus.arbiter().on_deadline(bus.now());
    EXPECT_EQ(bus.sent.size(), 1u);
    bus.run_for(5s);
    EXPECT_TRUE(bus.answered(ticket));
    EXPECT_TRUE(bus.arbiter().idle());
    EXPECT_FALSE(bus.arbiter().next_deadline());
}

TEST_F(ArbiterTest, EndlessNoiseEndsInATimeoutNotInAHang) {
    const Ticket ticket = bus.submit(17, kWrite);
    bus.run_to_end_of_request();
    const Bytes noise(64, 0xA5);
    for (int i = 0; i < 1000 && !bus.answered(ticket); ++i) {
        bus.hear(noise);
        bus.run_for(5ms);
    }
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_FALSE(bus.answer(ticket).pdu.has_value());
}

}  // namespace
}  // namespace panelgate::arbiter
