#include "panelgate/modbus/rtu_request_framer.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::modbus {
namespace {

Bytes operator+(Bytes a, const Bytes& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

Bytes frame(const SerialAdu& adu) { return encode_adu(adu.station, adu.pdu); }

std::vector<SerialAdu> drain(RtuRequestFramer& framer) {
    std::vector<SerialAdu> frames;
    while (auto adu = framer.next()) frames.push_back(std::move(*adu));
    return frames;
}

std::vector<SerialAdu> fed(RtuRequestFramer& framer, ByteView bytes) {
    framer.feed(bytes);
    return drain(framer);
}

std::vector<SerialAdu> after_silence(RtuRequestFramer& framer) {
    framer.on_silence();
    return drain(framer);
}

const SerialAdu kRead{0x11, "03 00 6B 00 03"_hex};
const SerialAdu kOther{0x1F, "06 00 01 00 03"_hex};
const SerialAdu kVendor{0x05, "41 01 02 03"_hex};

class KnownLength : public ::testing::TestWithParam<Bytes> {};

TEST_P(KnownLength, EndsWithItsLastByte) {
    const SerialAdu adu{0x21, GetParam()};
    const Bytes bytes = frame(adu);
    RtuRequestFramer framer;
    for (std::size_t i = 0; i + 1 < bytes.size(); ++i)
        ASSERT_TRUE(fed(framer, ByteView(bytes).subspan(i, 1)).empty()) << i;
    EXPECT_TRUE(framer.partial());
    EXPECT_EQ(fed(framer, ByteView(bytes).last(1)), std::vector{adu});
    EXPECT_FALSE(framer.partial());
    EXPECT_EQ(fed(framer, bytes + bytes), (std::vector{adu, adu})) << "glued";
    EXPECT_EQ(framer.take_faults(), 0U);
}
INSTANTIATE_TEST_SUITE_P(
    Functions, KnownLength,
    ::testing::Values("01 0013 0013"_hex, "02 00C4 0016"_hex, "03 006B 0003"_hex,
                      "04 0008 0001"_hex, "05 00AC FF00"_hex, "06 0001 0003"_hex, "07"_hex,
                      "08 0000 A537"_hex, "08 000B 0000"_hex, "0B"_hex, "0C"_hex,
                      "0F 0013 000A 02 CD01"_hex, "10 0001 0002 04 000A 0102"_hex, "11"_hex,
                      "14 0E 06 0004 0001 0002 06 0003 0009 0002"_hex,
                      "15 0D 06 0004 0007 0003 06AF 04BE 100D"_hex, "16 0004 00F2 0025"_hex,
                      "17 0003 0006 000E 0003 06 00FF 00FF 00FF"_hex, "18 04DE"_hex,
                      "2B 0E 01 00"_hex, "10 0000 007B F6"_hex + Bytes(246, 0x10)));

TEST(RtuRequestFramer, StepsOverStrayBytesInFrontOfARequest) {
    for (unsigned stray = 0; stray < 256; ++stray) {
        RtuRequestFramer framer;
        std::vector<SerialAdu> frames =
            fed(framer, Bytes{static_cast<std::uint8_t>(stray)} + frame(kRead) + frame(kOther));
        for (SerialAdu& late : after_silence(framer)) frames.push_back(std::move(late));
        EXPECT_EQ(frames, (std::vector{kRead, kOther})) << stray;
        EXPECT_EQ(framer.take_faults(), 1U) << stray;
        EXPECT_FALSE(framer.partial());
    }
}

TEST(RtuRequestFramer, ADamagedRequestIsSteppedOver) {
    Bytes damaged = frame(kRead);
    damaged[4] ^= 0x01;
    RtuRequestFramer framer;
    std::vector<SerialAdu> frames = fed(framer, damaged + frame(kOther));
    for (SerialAdu& late : after_silence(framer)) frames.push_back(std::move(late));
    EXPECT_EQ(frames, std::vector{kOther});
    EXPECT_EQ(framer.take_faults(), 1U);
    EXPECT_EQ(framer.discarded(), 0U) << "a good frame was found since";
}

TEST(RtuRequestFramer, P1DataOfAWriteIsNoRequest) {
    const Bytes inside = frame({1, "06 0000 BEEF"_hex});
    const SerialAdu write{1, "10 0000 0004 08"_hex + inside};
    const Bytes bytes = frame(write);
    RtuRequestFramer framer;
    EXPECT_TRUE(fed(framer, ByteView(bytes).first(bytes.size() - 1)).empty());
    EXPECT_EQ(fed(framer, ByteView(bytes).last(1)), std::vector{write});
}

TEST(RtuRequestFramer, SilenceGivesUpAStartThatHoldsUpAGoodFrame) {
    RtuRequestFramer framer;
    EXPECT_TRUE(fed(framer, "07 10 00 00 00 7B F6"_hex + frame(kRead)).empty()) << "it may be data";
    EXPECT_EQ(after_silence(framer), std::vector{kRead});
    EXPECT_FALSE(framer.partial());
}

TEST(RtuRequestFramer, SilenceAloneDoesNotGiveUpAHalfSentRequest) {
    RtuRequestFramer framer;
    EXPECT_TRUE(fed(framer, "11 03 00"_hex).empty());
    EXPECT_TRUE(after_silence(framer).empty());
    const Bytes bytes = frame(kRead);
    EXPECT_EQ(fed(framer, ByteView(bytes).subspan(3)), std::vector{kRead});
}

TEST(RtuRequestFramer, GivesUpWhatWillNotCome) {
    RtuRequestFramer framer;
    EXPECT_TRUE(fed(framer, "11 03 00"_hex).empty());
    framer.drop_pending();
    EXPECT_FALSE(framer.partial());
    EXPECT_EQ(framer.discarded(), 3U);
    EXPECT_EQ(framer.take_faults(), 1U);
    EXPECT_TRUE(fed(framer, frame(kVendor)).empty());
    EXPECT_EQ(after_silence(framer), std::vector{kVendor});
}

TEST(RtuRequestFramer, FunctionsWithoutALengthRuleEndBySilence) {
    RtuRequestFramer framer;
    EXPECT_TRUE(fed(framer, frame(kVendor)).empty());
    EXPECT_EQ(after_silence(framer), std::vector{kVendor});
    const SerialAdu loop{1, "08 0000 1234 5678"_hex};
    EXPECT_TRUE(fed(framer, frame(loop)).empty());
    EXPECT_EQ(after_silence(framer), std::vector{loop});
    const SerialAdu reserved{1, "83 02"_hex};
    EXPECT_TRUE(fed(framer, frame(reserved)).empty());
    EXPECT_EQ(after_silence(framer), std::vector{reserved}) << "others refuse it";
    EXPECT_EQ(framer.take_faults(), 0U);
}

TEST(RtuRequestFramer, ARequestBehindOneOfAVendorWaitsForTheSilenceWithIt) {
    RtuRequestFramer framer;
    EXPECT_TRUE(fed(framer, frame(kVendor) + frame(kRead)).empty());
    EXPECT_EQ(after_silence(framer), (std::vector{kVendor, kRead}));
    EXPECT_EQ(framer.take_faults(), 0U);
}

TEST(RtuRequestFramer, ARequestThatIsTooShortEndsBySilence) {
    RtuRequestFramer framer;
    const SerialAdu half{1, "03 00"_hex};
    EXPECT_TRUE(fed(framer, frame(half)).empty());
    EXPECT_EQ(after_silence(framer), std::vector{half}) << "its length is judged by others";
}

TEST(RtuRequestFramer, HoldsNoMoreThanOneFrame) {
    RtuRequestFramer framer;
    std::size_t given = 0;
    for (int i = 0; i < 100; ++i) given += fed(framer, Bytes(100, 0x41)).size();
    EXPECT_EQ(given, 0U);
    EXPECT_GE(framer.discarded(), 10000U - 256U);
    framer.drop_pending();
    EXPECT_EQ(fed(framer, frame(kRead)), std::vector{kRead});
}

}  // namespace
}  // namespace panelgate::modbus
