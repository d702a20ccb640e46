// Writes, broadcasts and deadlines (P2, P3): nothing is sent twice, or without a client.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "arbiter_fixture.hpp"
#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::arbiter_writes_test {
namespace {

const Bytes kToAll = "10 00 64 00 02 04 00 0A 01 02"_hex;
const Bytes kToOne = "10 00 64 00 02 04 00 0B 00 00"_hex;
const Bytes kElsewhere = "10 00 68 00 02 04 00 0B 00 00"_hex;
const Bytes kConfirmed = "10 00 64 00 02"_hex;

/// The answers that this arbiter gives now.
std::vector<Finish> finished(Arbiter& arbiter) {
    std::vector<Finish> all;
    while (auto action = arbiter.poll_action()) {
        if (const auto* finish = std::get_if<Finish>(&*action)) all.push_back(*finish);
    }
    return all;
}

TEST_F(ArbiterTest, P2NeverRepeatsAWriteUnlessTheStationAllowsIt) {
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
    settings.stations[0].retry_writes = true;
    BusScript script{settings};
    script.submit(17, kWrite);
    script.run_for(5s);
    EXPECT_EQ(script.sent.size(), 2u);
}

/// P4: nobody asks again, and all of it may still come behind its first bytes and others' frames.
TEST_F(ArbiterTest, P4AConfirmationThatBeginsAnewBehindOthersFramesIsAwaited) {
    for (int i = 0; i < 16; ++i) {
        bus.submit(17, kRead);
        answer_next(bus, 17, kReply, 3ms);
    }
    const Ticket ticket = bus.submit(17, kToOne);
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    bus.hear_paced("11 10"_hex);
    bus.run_for(4ms);
    bus.hear_paced(modbus::encode_adu(40, kReply));
    bus.run_for(30ms);
    bus.hear_paced(modbus::encode_adu(17, kConfirmed));
    bus.run_for(5ms);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kConfirmed);
}

TEST_F(ArbiterTest, P6ReportsWhatAWriteTouchesWhenItLeavesAndWhenItsAttemptIsOver) {
    bus.submit(17, kRead);
    answer(bus, 17, kReply);
    EXPECT_TRUE(bus.written.empty()) << "a read";
    bus.submit(17, kToAll);
    ASSERT_TRUE(bus.next_sent());
    ASSERT_EQ(bus.written.size(), 1u);
    EXPECT_EQ(bus.written[0].station, 17);
    EXPECT_EQ(bus.written[0].items, (modbus::Span{modbus::Table::holding_registers, 100, 2}));
    EXPECT_FALSE(bus.written[0].ended);
    bus.run_for(5s);
    ASSERT_EQ(bus.written.size(), 2u) << "nobody answered";
    EXPECT_TRUE(bus.written[1].ended);
    bus.submit(0, kWrite);
    bus.run_for(1s);
    ASSERT_EQ(bus.written.size(), 4u);
    EXPECT_EQ(bus.written[3].station, 0);
    bus.submit(17, "41 01 02"_hex);
    bus.run_for(5s);
    EXPECT_FALSE(bus.written.back().items) << "nobody knows what it does";
}

TEST_F(ArbiterTest, ABroadcastIsAnsweredWhenItHasLeftAndTheLineRestsForTheTurnaround) {
    struct Row {
        Bytes pdu;
        Bytes confirmed;
    };
    const Row rows[] = {
        {kWrite, kWrite}, {kToAll, kConfirmed},  // several items: address and quantity
    };
    for (const Row& row : rows) {
        BusScript script{settings};
        const Ticket broadcast = script.submit(0, row.pdu, 1, PriorityClass::write);
        script.submit(17, kRead, 2);
        script.run_to_end_of_request();
        EXPECT_EQ(script.answer(broadcast).pdu.value(), row.confirmed);
        const TimePoint end = script.now();
        EXPECT_EQ(script.next_sent().value().at - end, 100ms);
        EXPECT_EQ(script.arbiter().counters().broadcasts, 1u);
    }
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
    const auto answers = finished(arbiter);
    ASSERT_EQ(answers.size(), 1u);
    EXPECT_EQ(answers[0].pdu.error(), Fault::timeout);
}

TEST_F(ArbiterTest, AReplyToABroadcastIsCountedAndGivenToNoClient) {
    const Ticket broadcast = bus.submit(0, kWrite);
    const Ticket read = bus.submit(17, kRead, 2);
    answer(bus, 17, kReply, 10ms);
    EXPECT_TRUE(bus.answered(broadcast));
    EXPECT_FALSE(bus.answered(read));
}

/// Rates may differ by 2 %, and a long request has left that much sooner than computed.
TEST_F(ArbiterTest, P2AWriteIsConfirmedByAPanelWhoseClockIsFast) {
    const Bytes write = Writer().u8(16).u16(100).u16(123).u8(246).raw(Bytes(246)).take();
    const Bytes confirmation = "10 00 64 00 7B"_hex;
    for (int i = 0; i < 3; ++i) {
        bus.submit(17, write);
        answer(bus, 17, confirmation, 3ms);
        bus.run_for(10ms);
    }
    const Ticket ticket = bus.submit(17, write);
    bus.run_for(wire_time(settings.serial, 255) * 99 / 100);
    bus.hear_reply(17, confirmation);
    bus.run_for(100ms);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), confirmation);
}

/// The reply repeats another one, so it is kept as a candidate; meanwhile the process is stopped.
TEST_F(ArbiterTest, P3ACandidateIsNotGivenToClientsItIsTooLateFor) {
    bus.submit(17, read_at(1));
    answer(bus, 17, kReply, 3ms);
    const Ticket second = bus.submit(17, read_at(2));
    answer_next(bus, 17, kReply, 3ms);
    ASSERT_FALSE(bus.answered(second));
    bus.arbiter().on_deadline(bus.now() + settings.queue.deadline);
    const auto answers = finished(bus.arbiter());
    ASSERT_EQ(answers.size(), 1u);
    EXPECT_EQ(answers[0].ticket, second);
    EXPECT_EQ(answers[0].pdu.error(), Fault::timeout);
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

TEST_F(ArbiterTest, P2ACancelledClientsQueueNeverReachesTheWire) {
    const Ticket on_wire = bus.submit(17, kRead, 1);
    const Ticket queued = bus.submit(17, kWrite, 1);
    bus.cancel(1);
    EXPECT_EQ(bus.answer(queued).pdu.error(), Fault::cancelled);
    EXPECT_FALSE(bus.answer(queued).transmitted);
    answer(bus, 17, kReply);
    EXPECT_EQ(bus.answer(on_wire).pdu.value(), kReply);
    bus.run_for(5s);
    EXPECT_EQ(bus.sent.size(), 1u);
}

/// What the replies of a panel that wrongly answers broadcasts may be taken for (P8).
class ArbiterBehindABroadcast : public ArbiterTest {
  protected:
    /// Station 17 has needed so long for its answers.
    static void teach(BusScript& script, Duration think) {
        script.submit(17, kRead);
        answer(script, 17, kReply, think);
        script.run_for(1s);
    }
    /// When its last bit has left.
    static TimePoint broadcast(BusScript& script) {
        script.submit(0, kToAll, 1, PriorityClass::write);
        script.run_to_end_of_request();
        return script.now();
    }
    static std::optional<TimePoint> sent(BusScript& script, std::uint8_t station, const Bytes& pdu,
                                         TimePoint until) {
        script.run_until(until);
        const Bytes adu = modbus::encode_adu(station, pdu);
        const auto found = std::ranges::find(script.sent, adu, &BusScript::Sent::adu);
        return found == script.sent.end() ? std::nullopt : std::optional(found->at);
    }
};

TEST_F(ArbiterBehindABroadcast, P8ALateReplyToItConfirmsNoWrite) {
    teach(bus, 150ms);
    const TimePoint left = broadcast(bus);
    const Ticket write = bus.submit(17, kToOne, 2, PriorityClass::write);
    bus.run_until(left + 150ms);
    bus.hear_reply(17, kConfirmed);
    EXPECT_FALSE(bus.answered(write));
    EXPECT_TRUE(sent(bus, 17, kToOne, left + 1500ms));
}

TEST_F(ArbiterBehindABroadcast, SuchAWriteGoesWhenItsStationHasHadAllTheTimeThatItEverNeeded) {
    for (const bool lost : {false, true}) {
        BusScript script{settings};
        teach(script, 150ms);
        script.submit(0, kToAll, 1, PriorityClass::write);
        const TimePoint left = script.now() + wire_time(settings.serial, kToAll.size() + 3);
        script.run_until(lost ? left - 100us : left);
        if (lost) {  // under the broadcast, which changes nothing
            script.line_down();
            script.line_up();
        }
        script.submit(17, kToOne, 2, PriorityClass::write);
        const auto at = sent(script, 17, kToOne, left + 1s);
        ASSERT_TRUE(at);
        EXPECT_GT(*at, left + 150ms);
        if (!lost) EXPECT_LT(*at, left + 300ms);
    }
}

TEST_F(ArbiterBehindABroadcast, WhatItsReplyCannotConfirmGoesAtTheTurnaround) {
    struct Row {
        Duration think;  ///< of station 17 before; 0: it was never heard
        std::uint8_t station;
        Bytes write;
        Duration later;  ///< than the broadcast's last bit
    };
    const Duration turnaround = settings.broadcast_turnaround;
    const Row rows[] = {
        {150ms, 17, kElsewhere, turnaround},                    // confirmed in other words
        {20ms, 17, kToOne, turnaround},                         // of a quick panel
        {0ms, 0, kToOne, turnaround},                           // another broadcast
        {0ms, 17, kToOne, settings.unlisted.response_timeout},  // never heard
    };
    for (const Row& row : rows) {
        BusScript script{settings};
        if (row.think > 0ms) teach(script, row.think);
        const TimePoint left = broadcast(script);
        script.submit(row.station, row.write, 2, PriorityClass::write);
        EXPECT_EQ(sent(script, row.station, row.write, left + 1s), left + row.later);
    }
}

/// A panel that executes a broadcast for 150 ms, is deaf meanwhile, and answers it then.
TEST_F(ArbiterBehindABroadcast,
       P8WhatMayBeItsAnswerConfirmsAWriteOnlyIfTheStationHoldsWhatWasWritten) {
    for (const bool holds : {false, true}) {
        BusScript script{settings};
        teach(script, 20ms);
        const TimePoint left = broadcast(script);
        const Ticket write = script.submit(17, kToOne, 2, PriorityClass::write);
        ASSERT_TRUE(sent(script, 17, kToOne, left + 150ms));
        script.hear_reply(17, kConfirmed);
        EXPECT_FALSE(script.answered(write));
        ASSERT_TRUE(script.next_sent(400ms));
        EXPECT_EQ(script.sent.back().adu[1], 3) << "what was written is read";
        Bytes held = Writer().u8(3).u8(kToOne[5]).take();
        held.insert(held.end(), kToOne.begin() + 6, kToOne.end());
        if (!holds) held.back() ^= 1;
        answer(script, 17, held, 20ms);
        EXPECT_EQ(script.answer(write).pdu.has_value(), holds);
        script.run_for(5s);
        const TimePoint again = broadcast(script);
        const Ticket next = script.submit(17, kToOne, 2, PriorityClass::write);
        EXPECT_EQ(sent(script, 17, kToOne, again + 150ms).has_value(), true);
        if (!holds) continue;
        script.hear_reply(17, kConfirmed);
        EXPECT_TRUE(script.answered(next)) << "it answers no broadcasts";
    }
}

TEST_F(ArbiterBehindABroadcast, OthersGoMeanwhile) {
    teach(bus, 150ms);
    const TimePoint left = broadcast(bus);
    bus.submit(17, kToOne, 2, PriorityClass::write);
    bus.submit(17, read_at(7), 3);
    EXPECT_EQ(sent(bus, 17, read_at(7), left + 110ms), left + settings.broadcast_turnaround);
}

TEST_F(ArbiterBehindABroadcast, AStationThatHasAnsweredOneIsWaitedForAsForAnyOutstandingReply) {
    teach(bus, 20ms);
    broadcast(bus);
    bus.run_for(20ms);
    bus.hear_reply(17, kConfirmed);
    bus.run_for(1s);
    const TimePoint left = broadcast(bus);
    bus.submit(17, kToOne, 2, PriorityClass::write);
    EXPECT_EQ(sent(bus, 17, kToOne, left + 1900ms), left + 2 * settings.unlisted.response_timeout);
}

/// A panel that says its last confirmation once more instead of doing the next write.
class ArbiterConfirmedAgain : public ArbiterTest {
  protected:
    ArbiterConfirmedAgain() {
        for (unsigned i = 0; i < 20; ++i) {
            bus.run_for(50ms);
            bus.submit(17, read_at(i));
            answer(bus, 17, reply_number(i), 12ms);
        }
    }
    /// Register 1 or 2 is written, and the confirmation of the one to `said` comes.
    Ticket write(unsigned at, unsigned value, unsigned said) {
        bus.run_for(1s);
        const Ticket ticket =
            bus.submit(17, Writer().u8(16).u16(at).u16(1).u8(2).u16(value).take());
        answer(bus, 17, Writer().u8(16).u16(said).u16(1).take(), 12ms);
        return ticket;
    }
    /// ... and is then found to hold this. Returns whether the write was confirmed.
    bool is_confirmed(unsigned at, unsigned value, unsigned held) {
        const Ticket ticket = write(at, value, at);
        EXPECT_FALSE(bus.answered(ticket));
        if (!bus.next_sent(200ms)) return false;
        EXPECT_EQ(bus.sent.back().adu,
                  modbus::encode_adu(17, Writer().u8(3).u16(at).u16(1).take()));
        answer(bus, 17, Writer().u8(3).u8(2).u16(held).take(), 12ms);
        EXPECT_TRUE(bus.answered(ticket));
        return bus.answer(ticket).pdu.has_value();
    }
};

TEST_F(ArbiterConfirmedAgain, P8OneThatRepeatsTheLastIsReadBack) {
    write(1, 7, 1);
    write(2, 8, 1);
    bus.run_for(2s);
    EXPECT_TRUE(is_confirmed(1, 9, 9));
    EXPECT_FALSE(is_confirmed(1, 9, 0));
}

/// ... a command that resets itself is not refused for ever.
TEST_F(ArbiterConfirmedAgain, P3WhereThatShowsNothingItIsBelievedAgainAfterTwoMinutes) {
    write(1, 7, 1);
    write(2, 8, 1);
    bus.run_for(timing::kForgetDuplicates);
    EXPECT_TRUE(is_confirmed(1, 9, 0));
}

/// ... also where each function has a reply buffer of its own.
TEST_F(ArbiterConfirmedAgain, P8TheLastOfEachFunctionMayComeAgain) {
    write(1, 7, 1);
    bus.run_for(1s);
    bus.submit(17, "0F 00 05 00 01 01 01"_hex);
    answer(bus, 17, "0F 00 05 00 01"_hex, 12ms);
    write(2, 8, 1);
    bus.run_for(2s);
    EXPECT_FALSE(is_confirmed(1, 9, 0));
}

/// This station's confirmation of a write of one register comes once more, or that came back.
void say_again(BusScript& script) {
    script.submit(17, kWrite, 1);
    answer(script, 17, kWrite, 12ms);
    script.run_for(5ms);
    script.hear_reply(17, kWrite);
    script.run_for(1s);
}

/// The same place is written again, with other values: its confirmation may be the last one's copy,
/// and the request lost. A place that holds neither is a command that has reset itself.
TEST_F(ArbiterTest, P8AConfirmationLikeTheOneBeforeIsNoneWhereThePlaceHoldsWhatThatConfirmed) {
    struct {
        Bytes read;
        bool is_true;
    } const cases[] = {{"03 04 00 0A 01 02"_hex, false},
                       {"03 04 00 0B 00 00"_hex, true},
                       {"03 04 00 00 00 00"_hex, true},
                       {"83 02"_hex, true}};
    for (const auto& one : cases) {
        BusScript script{settings};
        say_again(script);
        script.submit(17, kToAll, 1);
        answer(script, 17, kConfirmed, 12ms);
        const Ticket again = script.submit(17, kToOne, 1);
        ASSERT_TRUE(script.next_sent());
        answer(script, 17, kConfirmed, 12ms);
        EXPECT_FALSE(script.answered(again));
        ASSERT_TRUE(script.next_sent(1s));
        EXPECT_EQ(script.sent.back().adu, modbus::encode_adu(17, "03 00 64 00 02"_hex));
        answer(script, 17, one.read, 12ms);
        ASSERT_TRUE(script.answered(again));
        EXPECT_EQ(script.answer(again).pdu.has_value(), one.is_true) << to_hex(one.read);
    }
}

/// ... and nothing is read where that would tell nothing: the same values, or longer ago than
/// copies come; nor of a panel of which nothing has come twice.
TEST_F(ArbiterTest, P8AConfirmationLikeTheOneBeforeIsBelievedWhereAReadWouldTellNothing) {
    const auto write_again = [&](bool says_again, const Bytes& second, Duration later) {
        BusScript script{settings};
        if (says_again) say_again(script);
        const std::size_t before = script.sent.size();
        script.submit(17, kToAll, 1);
        answer(script, 17, kConfirmed, 12ms);
        script.run_for(later);
        const Ticket again = script.submit(17, second, 1);
        while (script.sent.size() < before + 2) script.run_for(1ms);
        answer(script, 17, kConfirmed, 12ms);
        script.run_for(1s);
        EXPECT_EQ(script.sent.size(), before + 2);
        return script.answered(again) && script.answer(again).pdu.has_value();
    };
    EXPECT_TRUE(write_again(true, kToAll, 0ms));
    EXPECT_TRUE(write_again(true, kToOne, 600ms));
    EXPECT_TRUE(write_again(false, kToOne, 0ms));
}

/// Reading back what a write has written.
TEST(ReadBack, P8CoilsAreComparedWithoutTheBitsThatNobodyWrote) {
    const Bytes twenty = "0F 00 64 00 14 03 CD 6B 05"_hex;
    ASSERT_TRUE(read_back(twenty));
    EXPECT_EQ(read_back(twenty)->pdu(), "01 00 64 00 14"_hex);
    EXPECT_TRUE(teaches_echo(*read_back(twenty))) << "03 is no address here";
    EXPECT_TRUE(holds_written(twenty, "01 03 CD 6B 05"_hex));
    EXPECT_TRUE(holds_written(twenty, "01 03 CD 6B F5"_hex)) << "padding";
    EXPECT_FALSE(holds_written(twenty, "01 03 CD 6B 0D"_hex));
    EXPECT_FALSE(holds_written(twenty, "81 02"_hex));
    EXPECT_FALSE(teaches_echo(test::request_of("01 03 64 00 14"_hex)));
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_writes_test
