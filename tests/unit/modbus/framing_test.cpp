#include "panelgate/modbus/framing.hpp"

#include <gtest/gtest.h>

#include <cstdint>

#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::modbus::framing_test {
namespace {

Bytes operator+(Bytes a, const Bytes& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

TEST(Framing, EachEncodesAnExceptionInItsOwnFormat) {
    EXPECT_EQ(encode_reply(Framing::tcp, 7, 17, "83 0A"_hex), "0007 0000 0003 11 83 0A"_hex);
    EXPECT_EQ(encode_reply(Framing::rtu, 7, 17, "83 0A"_hex), "11 83 0A C0 F2"_hex);
    EXPECT_EQ(encode_reply(Framing::ascii, 7, 17, "83 0A"_hex), encode_ascii(17, "83 0A"_hex));
}

TEST(Framing, OnlyOverTcpIsABroadcastAnswered) {
    EXPECT_TRUE(is_answered(Framing::tcp, 0));
    EXPECT_FALSE(is_answered(Framing::rtu, 0));
    EXPECT_FALSE(is_answered(Framing::ascii, 0));
    EXPECT_TRUE(is_answered(Framing::rtu, 1));
}

TEST(OtherFraming, OneThatSpeaksRtuIsRecognised) {
    // The last has an MBAP header in it that is right: length 2, function 0B of unit C4.
    for (const Bytes& pdu : {"03 0064 0005"_hex, "03 0000 000A"_hex, "01 0000 0001"_hex,
                             "03 0000 0002"_hex, "10 0000 0002 04 0001 0002"_hex, "11"_hex}) {
        const Bytes one = encode_adu(1, pdu);
        EXPECT_EQ(other_framing(Framing::tcp, one), Framing::rtu) << to_hex(one);
        EXPECT_EQ(other_framing(Framing::tcp, one + one), Framing::rtu) << to_hex(one);
        EXPECT_EQ(other_framing(Framing::ascii, one), Framing::rtu) << to_hex(one);
        EXPECT_EQ(other_framing(Framing::rtu, one), std::nullopt);
    }
    EXPECT_EQ(other_framing(Framing::tcp, encode_adu(0, "06 0000 0001"_hex)), Framing::rtu);
}

TEST(OtherFraming, ADamagedOrHalfSentFrameIsNotSure) {
    const Bytes good = encode_adu(1, "03 0064 0005"_hex);
    for (std::size_t size = 0; size < good.size(); ++size)
        EXPECT_EQ(other_framing(Framing::tcp, ByteView(good).first(size)), std::nullopt);
    Bytes bad = good;
    bad.back() ^= 1;
    EXPECT_EQ(other_framing(Framing::tcp, bad), std::nullopt);
}

TEST(OtherFraming, NoTransactionIdMakesAGoodAduSuspicious) {
    for (unsigned transaction = 0; transaction < 0x10000; ++transaction) {
        const auto id = static_cast<std::uint16_t>(transaction);
        const Bytes read = encode_mbap(id, 1, "03 0000 000A"_hex);
        ASSERT_EQ(other_framing(Framing::tcp, read), std::nullopt) << transaction;
        const Bytes write = encode_mbap(id, 5, "10 0000 0002 04 0001 0002"_hex);
        ASSERT_EQ(other_framing(Framing::tcp, write), std::nullopt) << transaction;
    }
}

TEST(OtherFraming, OneThatSpeaksAsciiIsRecognised) {
    const Bytes read = encode_ascii(1, "03 0000 0002"_hex);
    EXPECT_EQ(other_framing(Framing::tcp, read), Framing::ascii);
    EXPECT_EQ(other_framing(Framing::rtu, read), Framing::ascii);
    EXPECT_EQ(other_framing(Framing::ascii, read), std::nullopt);
}

TEST(OtherFraming, OneThatSpeaksModbusTcpIsRecognised) {
    const Bytes read = encode_mbap(1, 1, "03 0000 000A"_hex);
    EXPECT_EQ(other_framing(Framing::rtu, read), Framing::tcp);
    EXPECT_EQ(other_framing(Framing::ascii, read), Framing::tcp);
    EXPECT_EQ(other_framing(Framing::tcp, read), std::nullopt);
}

TEST(OtherFraming, ADamagedRequestInRtuThatIsRepeatedIsNoModbusTcp) {
    Bytes damaged = encode_adu(1, "03 0000 0006"_hex);
    damaged[6] ^= 0x10;
    const Bytes both = damaged + encode_adu(1, "03 0000 0006"_hex);
    for (std::size_t size = 0; size <= both.size(); ++size)
        EXPECT_EQ(other_framing(Framing::rtu, ByteView(both).first(size)), std::nullopt) << size;
}

TEST(OtherFraming, PipelinedRequestsOfModbusTcpAreRecognised) {
    const Bytes two = encode_mbap(1, 1, "03 0000 000A"_hex) + encode_mbap(2, 1, "06 0001 0002"_hex);
    EXPECT_EQ(other_framing(Framing::rtu, two), Framing::tcp);
    EXPECT_EQ(other_framing(Framing::ascii, two), Framing::tcp);
}

TEST(OtherFraming, AWriteInRtuThatIsHalfThereIsNoModbusTcp) {
    const Bytes write = encode_adu(1, "10 0000 0002 04 0001 0002"_hex);
    for (std::size_t size = 0; size <= write.size(); ++size)
        EXPECT_EQ(other_framing(Framing::rtu, ByteView(write).first(size)), std::nullopt) << size;
}

TEST(OtherFraming, TheWordsAreThoseOfTheConfiguration) {
    EXPECT_EQ(label(Framing::tcp), "tcp");
    EXPECT_EQ(label(Framing::rtu), "rtu");
    EXPECT_EQ(label(Framing::ascii), "ascii");
}

}  // namespace
}  // namespace panelgate::modbus::framing_test
