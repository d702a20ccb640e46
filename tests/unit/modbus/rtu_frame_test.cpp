#include "panelgate/modbus/rtu_frame.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <random>
#include <utility>

#include "support/hex.hpp"

namespace panelgate::modbus::rtu_frame_test {
namespace {

const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;

/// The procedure of serial line V1.02, 6.2.2, a bit at a time.
std::uint16_t slow_crc(ByteView bytes) {
    unsigned crc = 0xFFFF;
    for (const std::uint8_t byte : bytes) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) {
            const bool carry = (crc & 1) != 0;
            crc >>= 1;
            if (carry) crc ^= 0xA001;
        }
    }
    return static_cast<std::uint16_t>(crc);
}

TEST(Crc16, GivesTheValuesOfTheStandard) {
    EXPECT_EQ(crc16("31 32 33 34 35 36 37 38 39"_hex), 0x4B37) << "check value of the algorithm";
    EXPECT_EQ(crc16("02 07"_hex), 0x1241) << "example of the serial line guide";
    EXPECT_EQ(crc16({}), 0xFFFF);
    EXPECT_EQ(crc16("02 07 41 12"_hex), 0) << "over a frame with its CRC";
}

TEST(Crc16, AgreesWithTheBitwiseProcedure) {
    std::mt19937 random(1);
    for (std::size_t size = 0; size < 300; ++size) {
        Bytes bytes(size);
        for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
        ASSERT_EQ(crc16(bytes), slow_crc(bytes)) << to_hex(bytes);
    }
}

TEST(RtuFrame, SendsTheLowByteOfTheCrcFirst) {
    EXPECT_EQ(encode_adu(0x02, "07"_hex), "02 07 41 12"_hex);
    EXPECT_TRUE(crc_ok("02 07 41 12"_hex));
    EXPECT_FALSE(crc_ok("02 07 12 41"_hex));
}

TEST(RtuFrame, HasFourBytesOrMoreWithoutALimitOfItsOwn) {
    EXPECT_FALSE(crc_ok({}));
    EXPECT_FALSE(crc_ok("FF"_hex));
    EXPECT_FALSE(crc_ok("FF FF"_hex)) << "the residue of nothing is not a frame";
    EXPECT_FALSE(crc_ok("02 3E 81"_hex));
    const Bytes adu = encode_adu(0x14, Bytes(257, 0x55));
    EXPECT_EQ(adu.size(), 260u);
    EXPECT_TRUE(crc_ok(adu));
}

TEST(RtuFrame, ComesApartIntoStationAndPdu) {
    const Bytes adu = "11 03 00 6B 00 03 76 87"_hex;
    const std::optional<RtuFrame> frame = decode_adu(adu);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->station, 0x11);
    EXPECT_EQ(Bytes(frame->pdu.begin(), frame->pdu.end()), "03 00 6B 00 03"_hex);
}

TEST(RtuFrame, OfEverySingleBitErrorNoneIsTaken) {
    const Bytes adu = encode_adu(0x11, kReply);
    for (std::size_t bit = 0; bit < adu.size() * 8; ++bit) {
        Bytes wrong = adu;
        wrong[bit / 8] = static_cast<std::uint8_t>(wrong[bit / 8] ^ 1u << (bit % 8));
        EXPECT_FALSE(crc_ok(wrong)) << "bit " << bit;
        EXPECT_FALSE(decode_adu(wrong)) << "bit " << bit;
    }
}

TEST(CrcOrder, HighFirstIsTheSameCrcInReverseOrderAndGoodInItsOwnOnly) {
    const Bytes old = encode_adu(0x11, kReply, CrcOrder::high_first);
    EXPECT_EQ(old, "11 03 06 02 2B 00 00 00 64 BA C8"_hex);
    Bytes swapped = old;
    std::swap(swapped[swapped.size() - 2], swapped.back());
    EXPECT_EQ(swapped, encode_adu(0x11, kReply));
    EXPECT_TRUE(crc_ok(old, CrcOrder::high_first));
    EXPECT_FALSE(crc_ok(old));
    EXPECT_FALSE(crc_ok(swapped, CrcOrder::high_first));
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

}  // namespace
}  // namespace panelgate::modbus::rtu_frame_test
