// Order of the queue (P9).
#include <gtest/gtest.h>

#include <vector>

#include "arbiter_fixture.hpp"

namespace panelgate::arbiter::arbiter_queue_test {
namespace {

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

}  // namespace
}  // namespace panelgate::arbiter::arbiter_queue_test
