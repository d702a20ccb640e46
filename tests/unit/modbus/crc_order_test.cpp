#include "panelgate/modbus/rtu_frame.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <tuple>
#include <utility>

#include "panelgate/modbus/rtu_framer.hpp"
#include "support/hex.hpp"

namespace panelgate::modbus::crc_order_test {
namespace {

const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;

Bytes swapped(Bytes adu) {
    std::swap(adu[adu.size() - 2], adu[adu.size() - 1]);
    return adu;
}

TEST(CrcOrder, HighFirstIsTheSameCrcInReverseOrder) {
    const Bytes old = encode_adu(0x11, kReply, CrcOrder::high_first);
    EXPECT_EQ(old, "11 03 06 02 2B 00 00 00 64 BA C8"_hex);
    EXPECT_EQ(swapped(old), encode_adu(0x11, kReply));
}

TEST(CrcOrder, AFrameIsGoodInItsOwnOrderOnly) {
    const Bytes old = encode_adu(0x11, kReply, CrcOrder::high_first);
    EXPECT_TRUE(crc_ok(old, CrcOrder::high_first));
    EXPECT_FALSE(crc_ok(old));
    EXPECT_FALSE(crc_ok(swapped(old), CrcOrder::high_first));
    EXPECT_FALSE(crc_ok("11 03 06"_hex, CrcOrder::high_first)) << "no frame is so short";
}

TEST(CrcOrder, EachAddressOfALineHasItsOwn) {
    CrcOrders orders;
    orders.set(5, CrcOrder::high_first);
    EXPECT_EQ(orders.of(5), CrcOrder::high_first);
    EXPECT_EQ(orders.of(6), CrcOrder::low_first);
    EXPECT_TRUE(crc_ok(encode_adu(5, kReply, CrcOrder::high_first), orders));
    EXPECT_FALSE(crc_ok(encode_adu(5, kReply), orders));
    EXPECT_TRUE(crc_ok(encode_adu(6, kReply), orders));
    EXPECT_FALSE(crc_ok({}, orders));
}

/// Station 5 has the old order, high byte first; station 6 the standard's.
class FramerOfBothOrders : public ::testing::Test {
  protected:
    FramerOfBothOrders() { orders.set(5, CrcOrder::high_first); }
    CrcOrders orders;
    const Bytes old_reply = encode_adu(5, kReply, CrcOrder::high_first);
    const Bytes new_reply = encode_adu(6, kReply);
};

TEST_F(FramerOfBothOrders, P1AReplyCountsInTheOrderOfItsStationOnly) {
    ReplyFramer old_one(5, kRead, orders);
    EXPECT_EQ(old_one.feed(encode_adu(5, kReply)), std::nullopt);
    EXPECT_EQ(ReplyFramer(5, kRead, orders).feed(old_reply), kReply);
    EXPECT_EQ(ReplyFramer(6, kRead, orders).feed(new_reply), kReply);
    EXPECT_EQ(ReplyFramer(6, kRead, orders).feed(swapped(new_reply)), std::nullopt);
}

TEST_F(FramerOfBothOrders, P1AFrameOfTheOtherOrderInFrontIsSkippedWhole) {
    for (const auto& [asked, mine, theirs] : {std::tuple(std::uint8_t{6}, new_reply, old_reply),
                                              std::tuple(std::uint8_t{5}, old_reply, new_reply)}) {
        ReplyFramer framer(asked, kRead, orders);
        Bytes both = theirs;
        both.insert(both.end(), mine.begin(), mine.end());
        EXPECT_EQ(framer.feed(both), kReply);
        const auto unused = framer.take_unused();
        ASSERT_EQ(unused.size(), 1u);
        EXPECT_EQ(unused[0].kind, Unused::Kind::foreign);
        EXPECT_EQ(unused[0].bytes, theirs);
        EXPECT_FALSE(framer.was_damaged());
    }
}

TEST_F(FramerOfBothOrders, TheWrongOrderIsDamage) {
    const auto parts = classify_heard(encode_adu(5, kReply), 6, orders);
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_EQ(parts[0].kind, Unused::Kind::damaged);
    EXPECT_EQ(classify_heard(old_reply, 6, orders)[0].kind, Unused::Kind::foreign);
}

}  // namespace
}  // namespace panelgate::modbus::crc_order_test
