#include "reply_queue.hpp"

#include <gtest/gtest.h>

#include "support/hex.hpp"

namespace panelgate::tcp_server {
namespace {

using Ticket = ReplyQueue::Ticket;

TEST(ReplyQueue, LetsNoReplyOvertakeAnother) {
    ReplyQueue queue;
    const Ticket first = queue.open(1, 5);
    const Ticket second = queue.open(2, 6);
    queue.push(3, 7, "83 0a"_hex);
    queue.settle(second, "03 02 0002"_hex);
    EXPECT_EQ(queue.pop(), std::nullopt);
    queue.settle(first, "03 02 0001"_hex);
    EXPECT_EQ(queue.pop(), "0001 0000 0005 05 03 02 0001"_hex);
    EXPECT_EQ(queue.pop(), "0002 0000 0005 06 03 02 0002"_hex);
    EXPECT_EQ(queue.pop(), "0003 0000 0003 07 83 0a"_hex);
    EXPECT_EQ(queue.pop(), std::nullopt);
    EXPECT_TRUE(queue.empty());
}

TEST(ReplyQueue, TellsWhatWaitsForABusFromWhatWaitsForTheClient) {
    ReplyQueue queue;
    queue.push(1, 1, "83 0a"_hex);
    const Ticket slow = queue.open(2, 1);
    const Ticket quick = queue.open(3, 1);
    queue.settle(quick, "83 02"_hex);
    EXPECT_EQ(queue.unanswered(), 1U);
    EXPECT_EQ(queue.held(), 2U) << "an answer behind an unanswered request may not leave";
    EXPECT_EQ(queue.ready_bytes(), 9U);
    queue.settle(slow, "83 02"_hex);
    EXPECT_EQ(queue.unanswered(), 0U);
    EXPECT_EQ(queue.held(), 0U);
    EXPECT_EQ(queue.ready_bytes(), 27U);
    EXPECT_TRUE(queue.pop());
    EXPECT_EQ(queue.ready_bytes(), 18U);
}

TEST(ReplyQueue, StepsOverWhatGetsNoReply) {
    ReplyQueue queue;
    const Ticket silent = queue.open(1, 0);
    const Ticket last = queue.open(2, 0);
    queue.settle(last, "83 02"_hex);
    queue.drop(silent);
    EXPECT_EQ(queue.pop(), "0002 0000 0003 00 83 02"_hex);
    const Ticket silent_too = queue.open(3, 0);
    queue.drop(silent_too);
    EXPECT_EQ(queue.held(), 0U);
    EXPECT_EQ(queue.pop(), std::nullopt);
    EXPECT_TRUE(queue.empty());
}

}  // namespace
}  // namespace panelgate::tcp_server
