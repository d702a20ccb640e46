#include "pipeline.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <optional>

#include "support/hex.hpp"

namespace panelgate::tcp_server::reply_queue_test {
namespace {

using Ticket = ReplyQueue::Ticket;

/// Pops and returns the next reply; nothing if its turn has not come.
std::optional<Bytes> take(ReplyQueue& queue) {
    const Bytes* front = queue.front();
    if (front == nullptr) return std::nullopt;
    Bytes adu = *front;
    queue.pop();
    return adu;
}

TEST(ReplyQueue, LetsNoReplyOvertakeAnother) {
    ReplyQueue queue;
    const Ticket first = queue.open(1, 5);
    const Ticket second = queue.open(2, 6);
    queue.push(3, 7, "83 0a"_hex);
    queue.settle(second, "03 02 0002"_hex);
    EXPECT_EQ(take(queue), std::nullopt);
    queue.settle(first, "03 02 0001"_hex);
    EXPECT_EQ(take(queue), "0001 0000 0005 05 03 02 0001"_hex);
    EXPECT_EQ(take(queue), "0002 0000 0005 06 03 02 0002"_hex);
    EXPECT_EQ(take(queue), "0003 0000 0003 07 83 0a"_hex);
    EXPECT_EQ(take(queue), std::nullopt);
    EXPECT_TRUE(queue.empty());
}

TEST(ReplyQueue, CountsAReplyUntilItHasLeft) {
    ReplyQueue queue;
    queue.push(1, 1, "83 0a"_hex);
    const Ticket slow = queue.open(2, 1);
    const Ticket quick = queue.open(3, 1);
    queue.settle(quick, "83 02"_hex);
    EXPECT_EQ(queue.size(), 3U);
    EXPECT_EQ(queue.in_flight(), 2U) << "the third only waits for the second";
    queue.settle(slow, "83 02"_hex);
    EXPECT_EQ(queue.in_flight(), 3U) << "all wait for the client";
    for (std::size_t left = 3; left != 0; --left) {
        EXPECT_EQ(queue.size(), left);
        EXPECT_TRUE(take(queue));
        EXPECT_EQ(queue.in_flight(), left - 1);
    }
    EXPECT_TRUE(queue.empty());
}

TEST(ReplyQueue, WhatIsLeavingStaysWhereItIs) {
    ReplyQueue queue;
    queue.push(1, 1, "83 0a"_hex);
    const Bytes* leaving = queue.front();
    for (std::uint16_t i = 0; i < 1000; ++i) queue.push(i, 2, "83 02"_hex);
    EXPECT_EQ(queue.front(), leaving);
    EXPECT_EQ(*leaving, "0001 0000 0003 01 83 0a"_hex);
}

TEST(ReplyQueue, StepsOverWhatGetsNoReply) {
    ReplyQueue queue;
    const Ticket silent = queue.open(1, 0);
    const Ticket last = queue.open(2, 0);
    queue.settle(last, "83 02"_hex);
    queue.drop(silent);
    EXPECT_EQ(queue.size(), 1U) << "at once: nobody has to take it";
    EXPECT_EQ(take(queue), "0002 0000 0003 00 83 02"_hex);
    const Ticket silent_too = queue.open(3, 0);
    queue.drop(silent_too);
    EXPECT_EQ(take(queue), std::nullopt);
    EXPECT_TRUE(queue.empty());
}

}  // namespace
}  // namespace panelgate::tcp_server::reply_queue_test
