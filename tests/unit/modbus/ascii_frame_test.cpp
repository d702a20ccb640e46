#include "panelgate/modbus/ascii.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "support/hex.hpp"

namespace panelgate::modbus::ascii_frame_test {
namespace {

Bytes text(std::string_view characters) { return Bytes(characters.begin(), characters.end()); }

std::vector<SerialAdu> drain(AsciiFramer& framer) {
    std::vector<SerialAdu> frames;
    while (auto frame = framer.next()) frames.push_back(std::move(*frame));
    return frames;
}

/// Frames found in characters that come at once.
std::vector<SerialAdu> found(std::string_view characters) {
    AsciiFramer framer;
    framer.feed({}, text(characters));
    return drain(framer);
}

const SerialAdu kRead{0x11, "03 00 6B 00 03"_hex};
constexpr std::string_view kReadText = ":1103006B00037E\r\n";

TEST(AsciiFrame, TheCheckIsTheTwosComplementOfTheSum) {
    EXPECT_EQ(lrc("11 03 00 6B 00 03"_hex), 0x7E);
    EXPECT_EQ(lrc("11 03 00 6B 00 03 7E"_hex), 0);
    EXPECT_EQ(lrc({}), 0);
    // V1.02, 6.2.1: the bytes of the example with its result.
    EXPECT_EQ(lrc("02 07"_hex), 0xF7);
}

TEST(AsciiFrame, IsWrittenWithUpperCaseDigits) {
    EXPECT_EQ(encode_ascii(kRead.station, kRead.pdu), text(kReadText));
    EXPECT_EQ(encode_ascii(0xF7, "83 0A"_hex), text(":F7830A7C\r\n"));
}

TEST(AsciiFrame, TheLongestHas513Characters) {
    EXPECT_EQ(encode_ascii(1, Bytes(253, 0x41)).size(), kMaxAsciiAdu);
    EXPECT_EQ(encode_ascii(1, Bytes(1, 0x41)).size(), kMinAsciiAdu);
}

TEST(AsciiFramer, GivesStationAndPdu) { EXPECT_EQ(found(kReadText), std::vector{kRead}); }

TEST(AsciiFramer, TakesTheShortestAndTheLongest) {
    for (const std::size_t size : {std::size_t{1}, std::size_t{253}}) {
        const SerialAdu adu{247, Bytes(size, 0xA5)};
        AsciiFramer framer;
        framer.feed({}, encode_ascii(adu.station, adu.pdu));
        EXPECT_EQ(drain(framer), std::vector{adu}) << size;
    }
    AsciiFramer framer;
    framer.feed({}, encode_ascii(1, Bytes(254, 0xA5)));
    EXPECT_TRUE(drain(framer).empty());
    EXPECT_EQ(framer.take_faults(), 1U);
}

TEST(AsciiFramer, TakesCharactersInAnyPieces) {
    AsciiFramer framer;
    std::vector<SerialAdu> frames;
    for (const char character : std::string(kReadText) + std::string(kReadText)) {
        framer.feed({}, Bytes{static_cast<std::uint8_t>(character)});
        for (SerialAdu& frame : drain(framer)) frames.push_back(std::move(frame));
    }
    EXPECT_EQ(frames, (std::vector{kRead, kRead}));
    EXPECT_FALSE(framer.partial());
}

TEST(AsciiFramer, AColonBeginsAnew) {
    EXPECT_EQ(found(":1103:1103006B00037E\r\n"), std::vector{kRead});
    EXPECT_EQ(found(":1103006B00037E\r:1103006B00037E\r\n"), std::vector{kRead});
    EXPECT_EQ(found(":::1103006B00037E\r\n"), std::vector{kRead});
}

TEST(AsciiFramer, StepsOverWhatIsBetweenFrames) {
    EXPECT_EQ(found("\r\nnoise 11\n:1103006B00037E\r\n"), std::vector{kRead});
}

class BadFrame : public ::testing::TestWithParam<std::string_view> {};

TEST_P(BadFrame, IsDroppedAndCountedOnce) {
    AsciiFramer framer;
    framer.feed({}, text(GetParam()));
    EXPECT_TRUE(drain(framer).empty());
    EXPECT_FALSE(framer.partial());
    EXPECT_EQ(framer.discarded(), GetParam().size());
    EXPECT_EQ(framer.take_faults(), 1U);
    EXPECT_EQ(framer.take_faults(), 0U);
    framer.feed({}, text(kReadText));
    EXPECT_EQ(drain(framer), std::vector{kRead});
    EXPECT_EQ(framer.discarded(), 0U);
}
INSTANTIATE_TEST_SUITE_P(Frames, BadFrame,
                         ::testing::Values(":1103006B00037F\r\n",    // LRC
                                           ":1103006B00037e\r\n",    // a lower-case digit
                                           ":1103006B00037\r\n",     // half a byte
                                           ":1103006B0003 7E\r\n",   // a blank
                                           ":1103006B00037E\n",      // no CR
                                           ":1103006B00037E\rX\n",   // no LF
                                           ":1103006B00037E\r\r\n",  // nor here
                                           ":11EF\r\n",              // no function
                                           ":\r\n"));

TEST(AsciiFramer, TakesLowerCaseWhereThatIsWanted) {
    AsciiFramer framer(HexDigits::any_case);
    framer.feed({}, text(":1103006b00037e\r\n:1103006B00037E\r\n:1103006g00037E\r\n"));
    EXPECT_EQ(drain(framer), (std::vector{kRead, kRead}));
}

TEST(AsciiFramer, APauseOfOneSecondIsAllowedAndNoLongerOne) {
    AsciiFramer framer;
    const TimePoint start{};
    framer.feed(start, text(kReadText.substr(0, 5)));
    EXPECT_TRUE(drain(framer).empty());
    framer.feed(start + 1s, text(kReadText.substr(5)));
    EXPECT_EQ(drain(framer), std::vector{kRead});
    framer.feed(start + 2s, text(kReadText.substr(0, 5)));
    EXPECT_TRUE(drain(framer).empty());
    framer.feed(start + 3s + 1ns, text(kReadText.substr(5)));
    EXPECT_TRUE(drain(framer).empty());
    EXPECT_EQ(framer.take_faults(), 1U);
    framer.feed(start + 10s, text(kReadText));
    EXPECT_EQ(drain(framer), std::vector{kRead}) << "between frames there is no limit";
}

TEST(AsciiFramer, EveryByteThatIsWrittenIsReadAgain) {
    for (unsigned byte = 0; byte < 256; ++byte) {
        const SerialAdu adu{static_cast<std::uint8_t>(byte),
                            Bytes{0x41, static_cast<std::uint8_t>(byte)}};
        AsciiFramer framer;
        framer.feed({}, encode_ascii(adu.station, adu.pdu));
        EXPECT_EQ(drain(framer), std::vector{adu});
    }
}

}  // namespace
}  // namespace panelgate::modbus::ascii_frame_test
