#include "panelgate/modbus/rtu_frame.hpp"

#include <gtest/gtest.h>

#include "support/hex.hpp"

namespace panelgate::modbus::rtu_frame_test {
namespace {

TEST(RtuFrame, SendsTheLowByteOfTheCrcFirst) {
    EXPECT_EQ(encode_adu(0x02, "07"_hex), "02 07 41 12"_hex);
}

TEST(RtuFrame, RefusesTheCrcHighByteFirst) { EXPECT_FALSE(crc_ok("02 07 12 41"_hex)); }

TEST(RtuFrame, NeedsFourBytes) {
    EXPECT_FALSE(crc_ok({}));
    EXPECT_FALSE(crc_ok("FF"_hex));
    EXPECT_FALSE(crc_ok("FF FF"_hex)) << "the residue of nothing is not a frame";
    EXPECT_FALSE(crc_ok("02 3E 81"_hex));
    EXPECT_TRUE(crc_ok("02 07 41 12"_hex));
}

TEST(RtuFrame, ComesApartIntoStationAndPdu) {
    const Bytes adu = "11 03 00 6B 00 03 76 87"_hex;
    const std::optional<RtuFrame> frame = decode_adu(adu);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->station, 0x11);
    EXPECT_EQ(Bytes(frame->pdu.begin(), frame->pdu.end()), "03 00 6B 00 03"_hex);
}

TEST(RtuFrame, OfEverySingleBitErrorNoneIsTaken) {
    const Bytes adu = encode_adu(0x11, "03 06 02 2B 00 00 00 64"_hex);
    for (std::size_t bit = 0; bit < adu.size() * 8; ++bit) {
        Bytes wrong = adu;
        wrong[bit / 8] = static_cast<std::uint8_t>(wrong[bit / 8] ^ 1u << (bit % 8));
        EXPECT_FALSE(crc_ok(wrong)) << "bit " << bit;
        EXPECT_FALSE(decode_adu(wrong)) << "bit " << bit;
    }
}

TEST(RtuFrame, HasNoUpperLimitOfItsOwn) {
    const Bytes pdu(257, 0x55);
    const Bytes adu = encode_adu(0x14, pdu);
    EXPECT_EQ(adu.size(), 260u);
    EXPECT_TRUE(crc_ok(adu));
}

}  // namespace
}  // namespace panelgate::modbus::rtu_frame_test
