#include "panelgate/modbus/rtu_framer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::modbus::rtu_framer_test {
namespace {

const Bytes kRequest = "03 00 6B 00 03"_hex;
const Bytes kReplyPdu = "03 06 02 2B 00 00 00 64"_hex;
const Bytes kReply = "11 03 06 02 2B 00 00 00 64 C8 BA"_hex;

Bytes joined(Bytes front, const Bytes& back) {
    front.insert(front.end(), back.begin(), back.end());
    return front;
}

TEST(RtuFramer, GivesTheReplyAtItsLastByteHoweverItIsCut) {
    for (std::size_t piece = 1; piece <= kReply.size(); ++piece) {
        ReplyFramer framer(0x11, kRequest);
        std::optional<Bytes> reply;
        for (std::size_t at = 0; at < kReply.size(); at += piece) {
            EXPECT_FALSE(reply);
            reply = framer.feed(ByteView(kReply).subspan(at, std::min(piece, kReply.size() - at)));
        }
        ASSERT_TRUE(reply);
        EXPECT_EQ(*reply, kReplyPdu);
    }
}

TEST(RtuFramer, ReportsMissingBytesIfItIsNoException) {
    ReplyFramer framer(0x11, kRequest);
    EXPECT_EQ(framer.missing_as_asked(), 0);
    framer.feed("11"_hex);
    EXPECT_EQ(framer.missing_as_asked(), 10);
    framer.feed("03"_hex);
    EXPECT_EQ(framer.missing_as_asked(), 9);
    framer.feed("04"_hex);
    EXPECT_EQ(framer.missing_as_asked(), framer.missing()) << "it says so itself";
    ReplyFramer refused(0x11, kRequest);
    refused.feed("11 83"_hex);
    EXPECT_EQ(refused.missing_as_asked(), 1);
    ReplyFramer foreign(0x11, kRequest);
    foreign.feed("12"_hex);
    EXPECT_EQ(foreign.missing_as_asked(), 0);
}

TEST(RtuFramer, ReportsTheMinimumOfMissingBytes) {
    ReplyFramer framer(0x11, kRequest);
    EXPECT_EQ(framer.missing(), 0);
    framer.feed("11"_hex);
    EXPECT_EQ(framer.missing(), 2);
    framer.feed("03"_hex);
    EXPECT_EQ(framer.missing(), 1);
    framer.feed("06"_hex);
    EXPECT_EQ(framer.missing(), 8);
    framer.feed("02 2B 00 00 00 64 C8"_hex);
    EXPECT_EQ(framer.missing(), 1);
    framer.feed("BA"_hex);
    EXPECT_EQ(framer.missing(), 0);
}

TEST(RtuFramer, WithoutAReplyEveryByteMayDecide) {
    ReplyFramer framer(0x11, kRequest);
    framer.feed("22 03 06"_hex);
    EXPECT_EQ(framer.missing(), 0);
    framer.feed("11 03 04"_hex);
    EXPECT_EQ(framer.missing(), 0) << "a byte count that does not answer";
}

TEST(RtuFramer, TakesAnExceptionBeforeItLooksAtAnyByteCount) {
    ReplyFramer framer(0x11, kRequest);
    EXPECT_EQ(framer.feed("11 83 02 C1 34"_hex).value(), "83 02"_hex);
}

struct Case {
    const char* name;
    const char* heard;
};
class RtuFramerRejects : public testing::TestWithParam<Case> {};

TEST_P(RtuFramerRejects, AndStillTakesTheRightReplyAfterASilence) {
    ReplyFramer framer(0x11, kRequest);
    const Bytes heard = from_hex(GetParam().heard).value();
    EXPECT_FALSE(framer.feed(heard));
    EXPECT_FALSE(framer.on_silence());
    EXPECT_FALSE(framer.has_pending());
    EXPECT_EQ(framer.feed(kReply).value(), kReplyPdu);
    std::size_t unused = 0;
    for (const Unused& part : framer.take_unused()) unused += part.bytes.size();
    EXPECT_EQ(unused, heard.size());
}

INSTANTIATE_TEST_SUITE_P(
    All, RtuFramerRejects,
    testing::Values(Case{"CrcBytesSwapped", "11 03 06 02 2B 00 00 00 64 BA C8"},
                    Case{"OneBitFlip", "11 03 06 03 2B 00 00 00 64 C8 BA"},
                    Case{"Truncated", "11 03 06 02 2B 00 00"},
                    Case{"UnexpectedStation", "12 03 06 02 2B 00 00 00 64 DC 4A"},
                    Case{"WrongFunction", "11 04 06 02 2B 00 00 00 64 89 5C"},
                    Case{"StaleLength", "11 03 0A 00 01 00 02 00 03 00 04 00 05 F1 B4"}),
    [](const auto& info) { return info.param.name; });

TEST(RtuFramer, NamesWhatItSteppedOver) {
    ReplyFramer framer(0x11, kRequest);
    EXPECT_FALSE(framer.feed("12 03 06 02 2B 00 00 00 64 DC 4A"_hex));
    EXPECT_EQ(framer.feed(kReply).value(), kReplyPdu);
    const auto unused = framer.take_unused();
    ASSERT_EQ(unused.size(), 1u);
    EXPECT_EQ(unused[0].kind, Unused::Kind::foreign);
    EXPECT_EQ(unused[0].station, 0x12);
    EXPECT_FALSE(framer.was_damaged());
}

TEST(RtuFramer, ADamagedReplyIsNotSilence) {
    ReplyFramer framer(0x11, kRequest);
    framer.feed("11 03 06 03 2B 00 00 00 64 C8 BA"_hex);
    EXPECT_TRUE(framer.has_pending());
    framer.on_silence();
    EXPECT_TRUE(framer.was_damaged());
}

TEST(RtuFramer, StepsOverNoiseOfAnyKindInFrontAndBehind) {
    std::mt19937 random(7);
    for (int round = 0; round < 2000; ++round) {
        ReplyFramer framer(0x11, kRequest);
        Bytes heard;
        const std::size_t noise = random() % 65;
        for (std::size_t i = 0; i < noise; ++i) {
            // Anything but the station's address: a start that looks like ours waits for silence.
            const auto b = static_cast<std::uint8_t>(random());
            heard.push_back(b == 0x11 ? 0x00 : b);
        }
        heard.insert(heard.end(), kReply.begin(), kReply.end());
        const std::size_t tail = random() % 4;
        for (std::size_t i = 0; i < tail; ++i) heard.push_back(random() % 2 == 0 ? 0x00 : 0xFF);
        auto reply = framer.feed(heard);
        if (!reply && framer.is_inside()) reply = framer.on_silence();
        ASSERT_TRUE(reply) << to_hex(heard);
        EXPECT_EQ(*reply, kReplyPdu);
    }
}

TEST(RtuFramer, NoiseThatLooksLikeAStartDelaysTheReplyOnlyToTheSilence) {
    ReplyFramer framer(0x11, kRequest);
    Bytes heard = "11 03"_hex;
    heard.insert(heard.end(), kReply.begin(), kReply.end());
    auto reply = framer.feed(heard);
    if (!reply) reply = framer.on_silence();
    ASSERT_TRUE(reply);
    EXPECT_EQ(*reply, kReplyPdu);
}

TEST(RtuFramer, P1DataOfAnotherFrameIsNoReply) {
    const Bytes reply = joined("03 0B"_hex, kReply);
    const std::array others{encode_adu(0x12, reply),  // another station's
                            encode_adu(0x11, reply),  // its own, of another length
                            encode_adu(0x12, joined("10 00 00 00 08 10 00 00 00 00 00"_hex,
                                                    kReply))};  // another master's write
    for (const Bytes& other : others) {
        ReplyFramer framer(0x11, kRequest);
        for (std::size_t i = 0; i < other.size(); ++i)
            EXPECT_FALSE(framer.feed(ByteView(other).subspan(i, 1))) << i;
        EXPECT_FALSE(framer.on_silence());
        EXPECT_EQ(framer.feed(kReply).value(), kReplyPdu);
    }
}

TEST(RtuFramer, TheReplyBehindTheBeginningOfAnotherFrameWaitsForASilence) {
    ReplyFramer framer(0x11, kRequest);
    EXPECT_FALSE(framer.feed(joined("12 03 20"_hex, kReply)));
    EXPECT_TRUE(framer.is_inside());
    EXPECT_EQ(framer.on_silence().value(), kReplyPdu);
}

TEST(RtuFramer, KeepsItsMemoryBoundedUnderEndlessNoise) {
    ReplyFramer framer(0x11, kRequest);
    const Bytes noise(1000, 0x11);
    for (int i = 0; i < 1000; ++i) framer.feed(noise);
    framer.on_silence();
    std::size_t kept = 0;
    for (const Unused& part : framer.take_unused()) kept += part.bytes.size();
    EXPECT_LT(kept, 200'000u);
    EXPECT_EQ(framer.feed(kReply).value(), kReplyPdu);
}

TEST(RtuFramer, EveryOneByteDamageIsRejected) {
    for (std::size_t at = 0; at < kReply.size(); ++at) {
        for (unsigned bit = 0; bit < 8; ++bit) {
            ReplyFramer framer(0x11, kRequest);
            Bytes damaged = kReply;
            damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ (1u << bit));
            EXPECT_FALSE(framer.feed(damaged));
            EXPECT_FALSE(framer.on_silence()) << "byte " << at << " bit " << bit;
        }
    }
}

TEST(RtuFramer, ReadsTheTwoByteCountOfReadFifoQueue) {
    ReplyFramer framer(0x11, "18 04 DE"_hex);
    EXPECT_TRUE(framer.feed("11 18 00 06 00 02 01 B8 12 84 18 8D"_hex));
}

TEST(RtuFramer, SilenceEndsADeviceIdentificationWithAWrongCount) {
    const Bytes pdu =
        "2B 0E 01 01 00 00 03 00 02 41 42 01 01 43"_hex;  // announces 3 objects, has 2
    ReplyFramer framer(0x11, "2B 0E 01 00"_hex);
    EXPECT_FALSE(framer.feed(encode_adu(0x11, pdu)));
    EXPECT_EQ(framer.on_silence().value_or(Bytes{}), pdu);
}

TEST(RtuFramer, TakesTheLongFramesOfPanelsThatHaveThem) {
    Bytes pdu{0x01, 255};
    pdu.resize(257, 0x55);
    ReplyFramer framer(20, "01 00 20 07 F8"_hex);
    EXPECT_EQ(framer.feed(encode_adu(20, pdu)).value_or(Bytes{}), pdu);
}

}  // namespace
}  // namespace panelgate::modbus::rtu_framer_test
