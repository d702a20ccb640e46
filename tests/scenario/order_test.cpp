// What order tells of a station's replies, and what it does not.

#include <gtest/gtest.h>

#include "order.hpp"
#include "support/hex.hpp"

namespace panelgate::scenario {
namespace {

const Bytes kRead = "03 00 0A 00 01"_hex;
const Bytes kOther = "03 00 14 00 01"_hex;
const Bytes kLong = "03 00 0A 00 02"_hex;
const Bytes kOne = "03 02 00 01"_hex;
const Bytes kTwo = "03 02 00 02"_hex;
const Bytes kLongReply = "03 04 00 01 00 02"_hex;

class OrderTest : public testing::Test {
  protected:
    void ask(const Bytes& pdu) { order_.on_asked(now_ += 10ms, pdu); }
    bool is_last(const Bytes& pdu) { return order_.on_reply(now_ += 10ms, pdu, 300ms); }
    TimePoint now_{1h};
    Order order_;
};

TEST_F(OrderTest, AReplyBehindThatToALaterRequestIsToTheNext) {
    ask(kRead);
    ask(kLong);
    EXPECT_TRUE(is_last(kLongReply));
    ask(kOther);
    EXPECT_TRUE(is_last(kOne)) << "the first one's, for all that the world knows";
    EXPECT_FALSE(is_last(kTwo)) << "no order explains it";
    ask(kRead);
    EXPECT_FALSE(is_last("03 02 00 03"_hex)) << "order tells nothing more";
}

TEST_F(OrderTest, WhatMayBeToAnotherRequestIsNotTheLasts) {
    ask(kRead);
    ask(kOther);
    EXPECT_FALSE(is_last(kOne));
    EXPECT_TRUE(is_last(kTwo));
    ask(kRead);
    ask(kRead);
    EXPECT_TRUE(is_last("03 02 00 03"_hex)) << "of two attempts the value is the same";
    now_ += 300ms;
    ask(kOther);
    EXPECT_TRUE(is_last("03 02 00 04"_hex)) << "the second's reply can no longer come";
}

TEST_F(OrderTest, ACopyMayHaveAnsweredNothing) {
    ask(kLong);
    EXPECT_TRUE(is_last(kLongReply));
    ask(kRead);
    ask(kLong);
    EXPECT_TRUE(is_last(kLongReply)) << "as far as it is an answer";
    EXPECT_FALSE(is_last(kOne)) << "the first's, behind a copy";
    ask(kOther);
    EXPECT_TRUE(is_last(kTwo)) << "order still explains it";
}

}  // namespace
}  // namespace panelgate::scenario
