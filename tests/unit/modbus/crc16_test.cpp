#include "panelgate/modbus/rtu_frame.hpp"

#include <gtest/gtest.h>

#include <random>

#include "support/hex.hpp"

namespace panelgate::modbus::crc16_test {
namespace {

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

TEST(Crc16, GivesTheCheckValueOfTheAlgorithm) {
    EXPECT_EQ(crc16("31 32 33 34 35 36 37 38 39"_hex), 0x4B37);
}

TEST(Crc16, GivesTheExampleOfTheSerialLineGuide) { EXPECT_EQ(crc16("02 07"_hex), 0x1241); }

TEST(Crc16, StartsAtTheResidueOfNothing) { EXPECT_EQ(crc16({}), 0xFFFF); }

TEST(Crc16, IsZeroOverAFrameWithItsCrc) { EXPECT_EQ(crc16("02 07 41 12"_hex), 0); }

TEST(Crc16, AgreesWithTheBitwiseProcedure) {
    std::mt19937 random(1);
    for (std::size_t size = 0; size < 300; ++size) {
        Bytes bytes(size);
        for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
        ASSERT_EQ(crc16(bytes), slow_crc(bytes)) << to_hex(bytes);
    }
}

}  // namespace
}  // namespace panelgate::modbus::crc16_test
