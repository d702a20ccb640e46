#include "panelgate/modbus/rtu_request_framer.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <utility>
#include <vector>

#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::modbus::rtu_request_framer_test {
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

/// What these bytes and the silence behind them give.
std::vector<SerialAdu> heard(RtuRequestFramer& framer, ByteView bytes) {
    std::vector<SerialAdu> frames = fed(framer, bytes);
    for (SerialAdu& late : after_silence(framer)) frames.push_back(std::move(late));
    return frames;
}

/// The frame with another bit, in its data or in its CRC.
Bytes damaged_at(std::size_t byte, const SerialAdu& adu) {
    Bytes bytes = frame(adu);
    bytes[byte] ^= 0x01;
    return bytes;
}

const SerialAdu kRead{0x11, "03 00 6B 00 03"_hex};
const SerialAdu kOther{0x1F, "06 00 01 00 03"_hex};
const SerialAdu kVendor{0x05, "41 01 02 03"_hex};

void expect_end_at_last_byte(const Bytes& pdu) {
    SCOPED_TRACE(to_hex(pdu));
    const SerialAdu adu{0x21, pdu};
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

TEST(RtuRequestFramer, RequestsOfKnownLengthEndWithTheirLastByte) {
    for (const std::uint8_t function : "07 0B 0C 11"_hex) expect_end_at_last_byte(Bytes{function});
    for (const Bytes& pdu :
         {"01 0013 0013"_hex, "02 00C4 0016"_hex, "03 006B 0003"_hex, "04 0008 0001"_hex,
          "05 00AC FF00"_hex, "06 0001 0003"_hex, "08 0000 A537"_hex, "08 000B 0000"_hex,
          "0F 0013 000A 02 CD01"_hex, "10 0001 0002 04 000A 0102"_hex, "16 0004 00F2 0025"_hex,
          "14 0E 06 0004 0001 0002 06 0003 0009 0002"_hex,
          "15 0D 06 0004 0007 0003 06AF 04BE 100D"_hex,
          "17 0003 0006 000E 0003 06 00FF 00FF 00FF"_hex, "18 04DE"_hex, "2B 0E 01 00"_hex,
          "10 0000 007B F6"_hex + Bytes(246, 0x10)})
        expect_end_at_last_byte(pdu);
}

TEST(RtuRequestFramer, StepsOverStrayBytesAndADamagedRequest) {
    for (unsigned stray = 0; stray < 256; ++stray) {
        RtuRequestFramer framer;
        const Bytes front{static_cast<std::uint8_t>(stray)};
        EXPECT_EQ(heard(framer, front + frame(kRead) + frame(kOther)), (std::vector{kRead, kOther}))
            << stray;
        EXPECT_EQ(framer.take_faults(), 1U) << stray;
        EXPECT_FALSE(framer.partial());
    }
    const SerialAdu next{0x1F, "04 00 01 00 03"_hex};
    RtuRequestFramer framer;
    EXPECT_EQ(heard(framer, damaged_at(4, kRead) + frame(next)), std::vector{next});
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

/// Requests with `inside` in their data; complete, but for the CRC.
std::vector<Bytes> damaged_around(const Bytes& inside) {
    const auto size = static_cast<std::uint8_t>(inside.size());
    const auto sized = [&](Bytes head) {
        head.push_back(size);
        return head;
    };
    std::vector<Bytes> all;
    for (const Bytes& pdu :
         {sized("10 0100 0010"_hex) + inside, sized("0F 0100 0080"_hex) + inside,
          sized("17 0000 0001 0100 0010"_hex) + inside, "41"_hex + inside, "08 0000"_hex + inside,
          "2B 0D"_hex + inside,
          Bytes{0x15, static_cast<std::uint8_t>(size + 7)} + "06 0004 0007 0010"_hex + inside}) {
        Bytes damaged = encode_adu(1, pdu);
        damaged.back() ^= 0x5A;
        all.push_back(std::move(damaged));
    }
    return all;
}

const std::vector<SerialAdu> kWrites = {
    {1, "05 0000 FF00"_hex},         {1, "06 0000 BEEF"_hex},
    {2, "0F 0000 0008 01 FF"_hex},   {0, "06 0000 BEEF"_hex},
    {3, "10 0000 0001 02 BEEF"_hex}, {1, "16 0004 00F2 0025"_hex},
    {1, "08 0001 0000"_hex},         {1, "17 0000 0001 0000 0001 02 BEEF"_hex}};

/// Hears the bytes with a silence at `cut`.
void expect_only_reads(const Bytes& damaged, std::size_t cut) {
    RtuRequestFramer framer;
    std::vector<SerialAdu> frames = fed(framer, ByteView(damaged).first(cut));
    framer.on_silence();
    for (SerialAdu& adu : heard(framer, ByteView(damaged).subspan(cut)))
        frames.push_back(std::move(adu));
    framer.drop_pending();
    for (const SerialAdu& adu : frames) ASSERT_TRUE(adu == kRead || !check_request(adu.pdu)) << cut;
    ASSERT_GE(framer.take_faults(), 1U) << cut;
}

TEST(RtuRequestFramer, P2AWriteInTheDataOfADamagedRequestIsNotExecuted) {
    const Bytes read = frame(kRead);
    for (const SerialAdu& write : kWrites) {
        const Bytes inside = frame(write);
        for (const Bytes& data : {inside, "00 0A"_hex + inside + "0102"_hex, read + inside,
                                  inside + inside, "07 07 07"_hex + inside + read}) {
            for (const Bytes& damaged : damaged_around(data)) {
                for (std::size_t cut = 0; cut <= damaged.size(); ++cut) {
                    expect_only_reads(damaged, cut);
                    if (::testing::Test::HasFatalFailure()) return;
                }
            }
        }
    }
}

TEST(RtuRequestFramer, AWriteRightBehindADamagedRequestIsToBeSentAgain) {
    for (const Bytes& damaged : damaged_around("00 07 00 03 00 01"_hex)) {
        if (request_length(damaged).kind != RequestLength::Kind::known) continue;
        RtuRequestFramer framer;
        EXPECT_TRUE(heard(framer, damaged + frame(kOther)).empty());
        EXPECT_EQ(heard(framer, frame(kOther)), std::vector{kOther}) << damaged[1];
    }
}

TEST(RtuRequestFramer, WhatIsLeftOfADamagedRequestCostsTheNextOneBehindASilenceNothing) {
    RtuRequestFramer framer;
    EXPECT_TRUE(fed(framer, damaged_at(12, {0x11, "10 0001 0002 04 000A 0102"_hex})).empty());
    EXPECT_TRUE(framer.partial()) << "its tail may be a beginning";
    EXPECT_TRUE(after_silence(framer).empty());
    EXPECT_EQ(heard(framer, frame(kOther)), std::vector{kOther});
}

TEST(RtuRequestFramer, AGlitchInFrontOfAWriteIsNoDamage) {
    for (const Bytes& glitch : {"FF"_hex, "00"_hex, "00 FF"_hex, "FF FF FF"_hex}) {
        RtuRequestFramer framer;
        EXPECT_EQ(heard(framer, glitch + frame(kOther)), std::vector{kOther}) << glitch.size();
        EXPECT_EQ(fed(framer, frame(kOther)), std::vector{kOther}) << "it counts for itself";
    }
}

TEST(RtuRequestFramer, MoreFramesInARowThanOneCouldHoldAreTrusted) {
    Bytes stream = damaged_at(4, kRead);
    for (int i = 0; i < 40; ++i) stream = stream + frame(kOther);
    RtuRequestFramer framer;
    EXPECT_EQ(heard(framer, stream), std::vector(40 - 33, kOther))
        << "33 of 8 bytes are more than 256";
}

TEST(RtuRequestFramer, SilenceDiscardsAStartThatBlocksAValidFrame) {
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

TEST(RtuRequestFramer, WhatHasNoLengthOrAWrongOneEndsBySilence) {
    RtuRequestFramer framer;
    for (const SerialAdu& adu : {kVendor, SerialAdu{1, "08 0000 1234 5678"_hex},
                                 SerialAdu{1, "83 02"_hex},     // others refuse it
                                 SerialAdu{1, "03 00"_hex}}) {  // its length is judged by others
        EXPECT_TRUE(fed(framer, frame(adu)).empty()) << to_hex(adu.pdu);
        EXPECT_EQ(after_silence(framer), std::vector{adu});
    }
    EXPECT_TRUE(fed(framer, frame(kVendor) + frame(kRead)).empty()) << "the read waits with it";
    EXPECT_EQ(after_silence(framer), (std::vector{kVendor, kRead}));
    EXPECT_EQ(framer.take_faults(), 0U);
}

TEST(RtuRequestFramer, BuffersNoMoreThanOneFrame) {
    RtuRequestFramer framer;
    std::size_t given = 0;
    for (int i = 0; i < 100; ++i) given += fed(framer, Bytes(100, 0x41)).size();
    EXPECT_EQ(given, 0U);
    EXPECT_GE(framer.discarded(), 10000U - 256U);
    framer.drop_pending();
    EXPECT_EQ(fed(framer, frame(kRead)), std::vector{kRead});
}

}  // namespace
}  // namespace panelgate::modbus::rtu_request_framer_test
