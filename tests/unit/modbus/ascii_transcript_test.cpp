#include "panelgate/modbus/ascii.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::modbus::ascii_transcript_test {
namespace {

using End = AsciiTranscript::Piece::End;

Bytes text(std::string_view characters) { return Bytes(characters.begin(), characters.end()); }

const Bytes kReadPdu = "03 00 6B 00 03"_hex;
const Bytes kRead = encode_adu(0x11, kReadPdu);
constexpr std::string_view kReadText = ":1103006B00037E\r\n";

/// Bytes between two ends.
struct Part {
    Bytes bytes;
    End end = End::none;
    friend bool operator==(const Part&, const Part&) = default;
};

class Ear {
  public:
    explicit Ear(HexDigits digits = HexDigits::upper_only) : transcript(digits) {}

    void hear(std::string_view characters, TimePoint now = {}) {
        transcript.feed(now, text(characters));
        while (auto piece = transcript.next()) {
            open.insert(open.end(), piece->bytes.begin(), piece->bytes.end());
            if (piece->end == End::none) continue;
            parts.push_back({std::exchange(open, {}), piece->end});
        }
    }

    AsciiTranscript transcript;
    Bytes open;  ///< without an end so far
    std::vector<Part> parts;
};

std::vector<Part> heard(std::string_view characters) {
    Ear ear;
    ear.hear(characters);
    return ear.parts;
}

TEST(AsciiTranscript, AValidFrameIsTranscribedToRtu) {
    EXPECT_EQ(heard(kReadText), (std::vector<Part>{{kRead, End::frame}}));
    EXPECT_EQ(to_ascii(kRead), text(kReadText));
}

TEST(AsciiTranscript, TheShortestAndTheLongestAreFrames) {
    for (const std::size_t size : {std::size_t{1}, std::size_t{253}, std::size_t{261}}) {
        const Bytes adu = encode_adu(247, Bytes(size, 0xA5));
        Ear ear;
        ear.transcript.feed({}, to_ascii(adu));
        ear.hear("");
        EXPECT_EQ(ear.parts, (std::vector<Part>{{adu, End::frame}})) << size;
    }
}

TEST(AsciiTranscript, TheSameComesOfCharactersOneByOne) {
    Ear ear;
    for (const char character : std::string(kReadText)) ear.hear({&character, 1});
    EXPECT_EQ(ear.parts, (std::vector<Part>{{kRead, End::frame}}));
}

TEST(AsciiTranscript, StationAndFunctionAreReturnedAtOnce) {
    Ear ear;
    ear.hear(":11");
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
    const std::vector<Part> parts = heard(":1103006B00037F\r\n");
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_EQ(parts[0].end, End::damage);
    EXPECT_EQ(parts[0].bytes.size(), kRead.size());
    EXPECT_FALSE(crc_ok(parts[0].bytes, CrcOrder::low_first));
    EXPECT_FALSE(crc_ok(parts[0].bytes, CrcOrder::high_first));
}

TEST(AsciiTranscript, DamageEndsWithItsLineAndTheNextFrameIsGood) {
    for (const std::string damaged :
         {":1103006B0003 7E\r\n", ":1103006B00037\r\n", ":1103006B00037e\r\n", ":11EF\r\n",
          ":1103006B00037E\rX\n", "1103006B00037E\r\n", "\n"}) {
        const std::vector<Part> parts = heard(damaged + std::string(kReadText));
        ASSERT_EQ(parts.size(), 2u) << damaged;
        EXPECT_EQ(parts[0].end, End::damage) << damaged;
        EXPECT_EQ(parts[1], (Part{kRead, End::frame})) << damaged;
    }
}

TEST(AsciiTranscript, AColonEndsWhateverWasOpen) {
    for (const std::string cut : {":1103", ":1103006B0", ":1103006B00037E\r", "noise", ":"}) {
        const std::vector<Part> parts = heard(cut + std::string(kReadText));
        ASSERT_EQ(parts.size(), 2u) << cut;
        EXPECT_EQ(parts[0].end, End::damage) << cut;
        EXPECT_EQ(parts[1], (Part{kRead, End::frame})) << cut;
    }
    EXPECT_EQ(heard(":1103006B0:")[0].bytes, "11 03 00 6B"_hex);
}

TEST(AsciiTranscript, NoiseIsPassedOnUnchanged) {
    const std::vector<Part> parts = heard("ab\r\n");
    EXPECT_EQ(parts, (std::vector<Part>{{text("ab\r\n"), End::damage}}));
}

TEST(AsciiTranscript, LowerCaseIsTakenWhereThatIsWanted) {
    Ear ear(HexDigits::any_case);
    ear.hear(":1103006b00037e\r\n");
    EXPECT_EQ(ear.parts, (std::vector<Part>{{kRead, End::frame}}));
}

TEST(AsciiTranscript, APauseOfOneSecondIsAllowedAndNoLongerOne) {
    Ear ear;
    const TimePoint start{};
    ear.hear(kReadText.substr(0, 6), start);
    ear.hear(kReadText.substr(6), start + 1s);
    EXPECT_EQ(ear.parts, (std::vector<Part>{{kRead, End::frame}}));
    ear.hear(kReadText.substr(0, 6), start + 5s);
    ear.hear(kReadText.substr(6), start + 6s + 1ns);
    ASSERT_EQ(ear.parts.size(), 3u);
    EXPECT_EQ(ear.parts[1], (Part{"11 03"_hex, End::damage}));
    EXPECT_EQ(ear.parts[2].end, End::damage) << "the rest is no frame";
    ear.hear(kReadText, start + 60s);
    EXPECT_EQ(ear.parts.back(), (Part{kRead, End::frame}));
}

TEST(AsciiTranscript, TheRestOfACutFrameIsNoise) {
    Ear ear;
    ear.hear(kReadText.substr(0, 6));
    ear.transcript.cut();
    EXPECT_FALSE(ear.transcript.has_given());
    ear.open.clear();
    ear.hear(kReadText.substr(6));
    ASSERT_EQ(ear.parts.size(), 1u);
    EXPECT_EQ(ear.parts[0].end, End::damage);
}

TEST(AsciiTranscript, AnRtuFrameIsNoFrame) {
    const Bytes adu = kRead;
    Ear ear;
    ear.hear({reinterpret_cast<const char*>(adu.data()), adu.size()});
    ear.hear(kReadText);
    ASSERT_EQ(ear.parts.size(), 2u);
    EXPECT_EQ(ear.parts[0].end, End::damage);
}

TEST(AsciiTranscript, EveryByteCanBeSaid) {
    for (unsigned byte = 0; byte < 256; ++byte) {
        const Bytes adu = encode_adu(static_cast<std::uint8_t>(byte),
                                     Bytes{0x41, static_cast<std::uint8_t>(byte)});
        Ear ear;
        ear.transcript.feed({}, to_ascii(adu));
        ear.hear("");
        EXPECT_EQ(ear.parts, (std::vector<Part>{{adu, End::frame}}));
    }
}

}  // namespace
}  // namespace panelgate::modbus::ascii_transcript_test
