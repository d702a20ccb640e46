#include "panelgate/modbus/ascii.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::modbus::ascii_test {
namespace {

using End = AsciiTranscript::Piece::End;

/// Bytes between two ends of a transcript.
struct Part {
    Bytes bytes;
    End end = End::none;
    friend bool operator==(const Part&, const Part&) = default;
};

const SerialAdu kRead{0x11, "03 00 6B 00 03"_hex};
const Part kWhole{encode_adu(kRead.station, kRead.pdu), End::frame};
const std::string kReadText = ":1103006B00037E\r\n";

Bytes text(std::string_view characters) { return Bytes(characters.begin(), characters.end()); }

/// Hears a line with both: the framer of a stream and the transcript for the RTU framers.
struct Ear {
    explicit Ear(HexDigits digits = HexDigits::upper_only) : framer(digits), transcript(digits) {}

    void hear(ByteView characters, TimePoint now = {}) {
        framer.feed(now, characters);
        while (auto frame = framer.next()) frames.push_back(std::move(*frame));
        transcript.feed(now, characters);
        while (auto piece = transcript.next()) {
            open.insert(open.end(), piece->bytes.begin(), piece->bytes.end());
            if (piece->end != End::none) parts.push_back({std::exchange(open, {}), piece->end});
        }
    }
    void hear(std::string_view characters, TimePoint now = {}) { hear(text(characters), now); }

    AsciiFramer framer;
    std::vector<SerialAdu> frames;
    AsciiTranscript transcript;
    std::vector<Part> parts;
    Bytes open;  ///< without an end so far
};

Ear heard(std::string_view characters, HexDigits digits = HexDigits::upper_only) {
    Ear ear(digits);
    ear.hear(characters);
    return ear;
}

TEST(Ascii, TheCheckIsTheTwosComplementOfTheSum) {
    EXPECT_EQ(lrc("11 03 00 6B 00 03"_hex), 0x7E);
    EXPECT_EQ(lrc("11 03 00 6B 00 03 7E"_hex), 0);
    EXPECT_EQ(lrc({}), 0);
    // V1.02, 6.2.1: the bytes of the example with its result.
    EXPECT_EQ(lrc("02 07"_hex), 0xF7);
}

TEST(Ascii, IsWrittenWithUpperCaseDigits) {
    EXPECT_EQ(encode_ascii(kRead.station, kRead.pdu), text(kReadText));
    EXPECT_EQ(encode_ascii(0xF7, "83 0A"_hex), text(":F7830A7C\r\n"));
    EXPECT_EQ(to_ascii(kWhole.bytes), text(kReadText));
    EXPECT_EQ(encode_ascii(1, Bytes(253, 0x41)).size(), kMaxAsciiAdu);
    EXPECT_EQ(encode_ascii(1, Bytes(1, 0x41)).size(), kMinAsciiAdu);
}

TEST(Ascii, IsReadInAnyPieces) {
    Ear ear = heard(kReadText);
    for (const char character : kReadText) ear.hear(std::string_view(&character, 1));
    EXPECT_EQ(ear.frames, (std::vector{kRead, kRead}));
    EXPECT_EQ(ear.parts, (std::vector{kWhole, kWhole}));
    EXPECT_FALSE(ear.framer.partial());
}

TEST(Ascii, EveryByteThatIsWrittenIsReadAgain) {
    for (unsigned value = 0; value < 256; ++value) {
        const auto byte = static_cast<std::uint8_t>(value);
        const SerialAdu adu{byte, Bytes{0x41, byte}};
        Ear ear;
        ear.hear(encode_ascii(adu.station, adu.pdu));
        EXPECT_EQ(ear.frames, std::vector{adu});
        EXPECT_EQ(ear.parts, (std::vector{Part{encode_adu(byte, adu.pdu), End::frame}}));
    }
}

/// 254 bytes are too many for the standard; 261 are the longest write to some panels.
TEST(Ascii, TheShortestAndTheLongestAreFrames) {
    for (const std::size_t size : {1u, 253u, 254u, 261u}) {
        const SerialAdu adu{247, Bytes(size, 0xA5)};
        const bool standard = size <= kMaxPdu;
        Ear ear;
        ear.hear(encode_ascii(adu.station, adu.pdu));
        EXPECT_EQ(ear.frames, std::vector(standard ? 1u : 0u, adu)) << size;
        EXPECT_EQ(ear.framer.take_faults(), standard ? 0u : 1u) << size;
        EXPECT_EQ(ear.parts, (std::vector{Part{encode_adu(247, adu.pdu), End::frame}})) << size;
    }
}

TEST(Ascii, DamageIsCountedOnceAndEndsWithItsLine) {
    for (const std::string_view damaged : {":1103006B00037F\r\n",    // LRC
                                           ":1103006B00037e\r\n",    // a lower-case digit
                                           ":1103006B00037\r\n",     // half a byte
                                           ":1103006B0003 7E\r\n",   // a blank
                                           ":1103006B00037E\n",      // no CR
                                           ":1103006B00037E\rX\n",   // no LF
                                           ":1103006B00037E\r\r\n",  // nor here
                                           ":11EF\r\n",              // no function
                                           ":\r\n"}) {
        SCOPED_TRACE(damaged);
        Ear ear = heard(damaged);
        EXPECT_TRUE(ear.frames.empty());
        EXPECT_FALSE(ear.framer.partial());
        EXPECT_EQ(ear.framer.discarded(), damaged.size());
        EXPECT_EQ(ear.framer.take_faults(), 1U);
        EXPECT_EQ(ear.framer.take_faults(), 0U);
        ear.hear(kReadText);
        EXPECT_EQ(ear.frames, std::vector{kRead});
        EXPECT_EQ(ear.framer.discarded(), 0U);
        ASSERT_EQ(ear.parts.size(), 2u);
        EXPECT_NE(ear.parts[0].end, End::frame);
        EXPECT_EQ(ear.parts[1], kWhole);
    }
}

TEST(Ascii, AColonEndsWhateverWasOpen) {
    for (const std::string before :
         {":1103", ":1103006B0", ":1103006B00037E\r", "noise", ":", "1103006B00037E\r\n", "\n"}) {
        SCOPED_TRACE(before);
        const Ear ear = heard(before + kReadText);
        EXPECT_EQ(ear.frames, std::vector{kRead});
        ASSERT_EQ(ear.parts.size(), 2u);
        EXPECT_EQ(ear.parts[0].end, before.ends_with("\n") ? End::damage : End::cut);
        EXPECT_EQ(ear.parts[1], kWhole);
    }
    for (const std::string before : {"::", "\r\nnoise 11\n"})
        EXPECT_EQ(heard(before + kReadText).frames, std::vector{kRead}) << before;
    EXPECT_EQ(heard(":1103006B0:").parts.at(0).bytes, "11 03 00 6B"_hex);
}

TEST(Ascii, TakesLowerCaseWhereThatIsWanted) {
    const Ear ear =
        heard(":1103006b00037e\r\n" + kReadText + ":1103006g00037E\r\n", HexDigits::any_case);
    EXPECT_EQ(ear.frames, (std::vector{kRead, kRead}));
    ASSERT_EQ(ear.parts.size(), 3u);
    EXPECT_EQ(ear.parts[0], kWhole);
    EXPECT_EQ(ear.parts[2].end, End::damage);
}

TEST(Ascii, APauseOfOneSecondIsAllowedAndNoLongerOne) {
    const TimePoint start{};
    const std::string front = kReadText.substr(0, 6);
    const std::string rest = kReadText.substr(6);
    Ear ear;
    ear.hear(front, start);
    ear.hear(rest, start + 1s);
    EXPECT_EQ(ear.frames, std::vector{kRead});
    EXPECT_EQ(ear.parts, std::vector{kWhole});
    ear.hear(front, start + 5s);
    ear.hear(rest, start + 6s + 1ns);
    EXPECT_EQ(ear.frames.size(), 1u);
    EXPECT_EQ(ear.framer.take_faults(), 1U);
    ASSERT_EQ(ear.parts.size(), 3u);
    EXPECT_EQ(ear.parts[1], (Part{"11 03"_hex, End::cut}));
    EXPECT_EQ(ear.parts[2].end, End::damage) << "the rest is no frame";
    ear.hear(kReadText, start + 60s);
    EXPECT_EQ(ear.frames.size(), 2u) << "between frames there is no limit";
    EXPECT_EQ(ear.parts.back(), kWhole);
}

TEST(AsciiTranscript, StationAndFunctionAreReturnedAtOnce) {
    Ear ear = heard(":11");
    EXPECT_EQ(ear.open, "11"_hex);
    ear.hear("03");
    EXPECT_EQ(ear.open, "11 03"_hex);
    ear.hear("00");
    EXPECT_EQ(ear.open, "11 03"_hex) << "this might be the LRC";
    ear.hear("6B");
    EXPECT_EQ(ear.open, "11 03 00"_hex);
    EXPECT_TRUE(ear.transcript.inside());
    EXPECT_TRUE(ear.transcript.has_given());
}

TEST(AsciiTranscript, AWrongLrcGivesAsManyBytesAndNoFrameInEitherOrder) {
    const Bytes bytes = heard(":1103006B00037F\r\n").parts.at(0).bytes;
    EXPECT_EQ(bytes.size(), kWhole.bytes.size());
    EXPECT_FALSE(crc_ok(bytes, CrcOrder::low_first));
    EXPECT_FALSE(crc_ok(bytes, CrcOrder::high_first));
}

TEST(AsciiTranscript, NoiseIsPassedOnUnchangedAndAnRtuFrameIsNoise) {
    EXPECT_EQ(heard("ab\r\n").parts, (std::vector{Part{text("ab\r\n"), End::damage}}));
    Ear ear;
    ear.hear(kWhole.bytes);
    ear.hear(kReadText);
    ASSERT_EQ(ear.parts.size(), 2u);
    EXPECT_NE(ear.parts[0].end, End::frame);
}

TEST(AsciiTranscript, TheRestOfACutFrameIsNoise) {
    Ear ear = heard(kReadText.substr(0, 6));
    ear.transcript.cut();
    EXPECT_FALSE(ear.transcript.has_given());
    ear.open.clear();
    ear.hear(kReadText.substr(6));
    ASSERT_EQ(ear.parts.size(), 1u);
    EXPECT_EQ(ear.parts[0].end, End::damage);
}

}  // namespace
}  // namespace panelgate::modbus::ascii_test
