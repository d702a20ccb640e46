// From a request's arrival to its turn: admission, order (P9), shared reads and memory (P6).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "arbiter_fixture.hpp"
#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/read_span.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::arbiter_queue_test {
namespace {

using modbus::encode_adu;

constexpr TimePoint kNow{1h};

Job job_of(const Bytes& pdu, std::uint8_t station = 17) {
    return {.station = station, .request = test::request_of(pdu)};
}

TEST(LatestStart, P3WhatStartsThenCanStillBeAnsweredByItsNormalReply) {
    const Bytes write = Writer().u8(0x10).u16(0).u16(100).u8(200).raw(Bytes(200)).take();
    struct Row {
        int baud;
        std::uint8_t station;
        Bytes pdu;
        std::size_t reply;  ///< bytes, address to CRC
    };
    const Row rows[] = {
        {1200, 17, kRead, 11},
        {9600, 17, kRead, 11},
        {115200, 17, kRead, 11},
        {9600, 17, "03 00 00 00 64"_hex, 205},
        {9600, 17, write, 8},
        {9600, 17, "11"_hex, 5},             // of unknown length: room for the shortest
        {9600, 0, "06 00 6B 00 01"_hex, 0},  // a broadcast only has to leave
    };
    for (const Row& row : rows) {
        const SerialFormat serial{.baud = row.baud};
        Job job = job_of(row.pdu, row.station);
        job.deadline = kNow;
        const Duration frames = wire_time(serial, row.pdu.size() + 3 + row.reply);
        const Duration gap = row.reply == 0 ? 0ms : silent_interval(serial);
        const Duration reserved = kNow - latest_start(serial, job);
        EXPECT_GE(reserved, frames + gap) << to_hex(row.pdu);
        EXPECT_LE(reserved, frames + gap + 1us) << to_hex(row.pdu);
    }
}

TEST_F(ArbiterTest, P3TheDeadlineCountsFromTheArrivalAndIsEarlierForAClientThatWaitsForLess) {
    settings.queue.deadline = 700ms;
    for (const Duration within : {job_of(kRead).within, Duration(300ms), Duration(1h)}) {
        Arbiter arbiter(settings);
        arbiter.on_line_up(kNow);
        Job job = job_of(kRead);
        job.within = within;
        ASSERT_TRUE(arbiter.submit(kNow, job));
        TimePoint now = kNow;
        for (bool answered = false; !answered;) {
            now = arbiter.next_deadline().value();
            arbiter.on_deadline(now);
            while (const auto action = arbiter.poll_action())
                answered = answered || std::holds_alternative<Finish>(*action);
        }
        EXPECT_EQ(now, kNow + std::min<Duration>(within, 700ms));
    }
}

/// The line is busy with station 18 while requests to station 17 queue.
class ArbiterSharingTest : public ArbiterTest {
  protected:
    ArbiterSharingTest() { bus.submit(18, kRead, 99); }
    /// Station 18 answers; returns the next request.
    Bytes next() {
        answer(bus, 18, kReply);
        return bus.next_sent().value().adu;
    }
    Bytes value(Ticket ticket) const { return bus.answer(ticket).pdu.value(); }
};

TEST_F(ArbiterSharingTest, P6IdenticalReadsShareOneTransaction) {
    std::vector<Ticket> tickets;
    for (Client client = 1; client <= 8; ++client) tickets.push_back(bus.submit(17, kRead, client));
    next();
    answer(bus, 17, kReply);
    for (const Ticket ticket : tickets) EXPECT_EQ(value(ticket), kReply);
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

TEST_F(ArbiterTest, P6NoReadJoinsWhatAFarEndMayHaveAlready) {
    bus.submit(17, kRead, 1);
    const Ticket late = bus.submit(17, kRead, 2);
    bus.hear_reply(17, kReply);
    EXPECT_FALSE(bus.answered(late)) << "the far end of a tcp line has the request at once";
}

TEST_F(ArbiterSharingTest, P6AClientNeverReadsOlderThanItsOwnWrite) {
    const Ticket others = bus.submit(17, kRead, 1);
    bus.submit(17, "06 00 6B 00 07"_hex, 2, PriorityClass::write);
    const Ticket own = bus.submit(17, kRead, 2);
    ASSERT_EQ(next()[1], 6);
    answer(bus, 17, "06 00 6B 00 07"_hex);
    answer_next(bus, 17, kReply);
    EXPECT_TRUE(bus.answered(others));
    EXPECT_TRUE(bus.answered(own)) << "after the write it may share";
    EXPECT_EQ(bus.sent.size(), 3u);
}

/// Values of station 17 may be so old, and station 17 was polled.
class ArbiterMemoryTest : public ArbiterTest {
  protected:
    void poll(Duration max_age) {
        settings.stations[0].max_age = max_age;
        bus.apply(settings);
        bus.submit(17, kRead, 9, PriorityClass::poll);
        answer(bus, 17, kReply, 3ms);
        bus.run_for(3ms);
    }
};

TEST_F(ArbiterMemoryTest, P6MemoryAnswersAClientButNeverAPoll) {
    poll(1s);
    const Ticket cached = bus.submit(17, kRead, 1);
    EXPECT_EQ(bus.answer(cached).pdu.value(), kReply);
    EXPECT_FALSE(bus.answer(cached).transmitted);
    EXPECT_EQ(bus.sent.size(), 1u);
    EXPECT_GT(bus.submit(17, kRead, 9, PriorityClass::poll), cached) << "a ticket of its own";
    EXPECT_EQ(bus.sent.size(), 2u);
    answer(bus, 17, kReply, 3ms);
    bus.run_for(1s);
    bus.submit(17, kRead, 1);
    EXPECT_EQ(bus.sent.size(), 3u) << "too old";
}

TEST_F(ArbiterMemoryTest, P6AClientNeverReadsOlderThanItsOwnWriteAlsoOneThatTimedOut) {
    poll(1min);
    const Ticket write = bus.submit(17, "06 00 6B 00 05"_hex, 1);
    const Ticket read = bus.submit(17, kRead, 1);
    EXPECT_FALSE(bus.answered(read)) << "its own write is still open";
    bus.run_for(490ms);  // silence; the timeout is 500 ms
    EXPECT_FALSE(bus.answered(write));
    ASSERT_TRUE(bus.next_sent(1s));
    ASSERT_TRUE(bus.answered(write));
    EXPECT_FALSE(bus.answered(read)) << "and what was known is forgotten";
    ASSERT_EQ(bus.sent.size(), 3u);
    EXPECT_EQ(bus.sent.back().adu[1], 3);
}

TEST_F(ArbiterMemoryTest, P6TheAgeOfAValueCountsFromTheFirstAttemptThatMayHaveHadThisReply) {
    settings.stations[0].max_age = 1s;
    BusScript script{settings};
    const TimePoint first = script.now();
    script.submit(17, kRead, 9, PriorityClass::poll);
    ASSERT_TRUE(script.next_sent());
    answer(script, 17, kReply, 3ms);
    script.run_until(first + 990ms);
    EXPECT_TRUE(script.answered(script.submit(17, kRead, 1)));
    script.run_until(first + 1010ms);
    EXPECT_FALSE(script.answered(script.submit(17, kRead, 1)));
}

TEST_F(ArbiterMemoryTest, IsEmptyAfterTheLineWasLost) {
    poll(1min);
    bus.line_down();
    bus.line_up();
    bus.run_for(10ms);
    EXPECT_FALSE(bus.answered(bus.submit(17, kRead, 1)));
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_queue_test
