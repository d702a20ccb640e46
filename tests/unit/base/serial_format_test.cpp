#include "panelgate/base/serial_format.hpp"

#include <gtest/gtest.h>

#include <ostream>
#include <string>

namespace panelgate::serial_format_test {
namespace {

SerialFormat even(int baud) { return {baud, 8, Parity::even, 1}; }
SerialFormat plain(int baud) { return {baud, 8, Parity::none, 1}; }

/// Milliseconds as the table prints them: equal to the last digit printed.
void expect_milliseconds(Duration time, double printed, double last_digit) {
    EXPECT_NEAR(to_milliseconds(time), printed, last_digit * 0.51);
}

struct Row {
    int baud;
    double character_11, character_10, silence, request_8, reply_25, reply_255, longest_256;
};
void PrintTo(const Row& row, std::ostream* out) { *out << row.baud; }

/// 11 (10) bits a character; 3.5 characters of silence, 1.750 ms above 19200 (V1.02, 2.5.1.1).
constexpr Row kRows[] = {
    {1200, 9.1667, 8.3333, 32.083, 73.333, 229.167, 2337.500, 2346.667},
    {2400, 4.5833, 4.1667, 16.042, 36.667, 114.583, 1168.750, 1173.333},
    {4800, 2.2917, 2.0833, 8.021, 18.333, 57.292, 584.375, 586.667},
    {9600, 1.1458, 1.0417, 4.010, 9.167, 28.646, 292.188, 293.333},
    {14400, 0.7639, 0.6944, 2.674, 6.111, 19.097, 194.792, 195.556},
    {19200, 0.5729, 0.5208, 2.005, 4.583, 14.323, 146.094, 146.667},
    {38400, 0.2865, 0.2604, 1.750, 2.292, 7.161, 73.047, 73.333},
    {57600, 0.1910, 0.1736, 1.750, 1.528, 4.774, 48.698, 48.889},
    {115200, 0.0955, 0.0868, 1.750, 0.764, 2.387, 24.349, 24.444},
};

class SerialTiming : public ::testing::TestWithParam<Row> {};

TEST_P(SerialTiming, IsThatOfTheTable) {
    const Row& row = GetParam();
    const SerialFormat format = even(row.baud);
    expect_milliseconds(character_time(format), row.character_11, 0.0001);
    expect_milliseconds(character_time(plain(row.baud)), row.character_10, 0.0001);
    expect_milliseconds(silent_interval(format), row.silence, 0.001);
    expect_milliseconds(wire_time(format, 8), row.request_8, 0.001);
    expect_milliseconds(wire_time(format, 25), row.reply_25, 0.001);
    expect_milliseconds(wire_time(format, 255), row.reply_255, 0.001);
    expect_milliseconds(wire_time(format, 256), row.longest_256, 0.001);
}

std::string name_of(const ::testing::TestParamInfo<Row>& info) {
    return "At" + std::to_string(info.param.baud);
}

INSTANTIATE_TEST_SUITE_P(Rates, SerialTiming, ::testing::ValuesIn(kRows), name_of);

TEST(SerialTimingAt38400, Counts10BitsWithoutParity) {
    const SerialFormat format = plain(38400);
    expect_milliseconds(wire_time(format, 8), 2.0833, 0.0001);
    expect_milliseconds(wire_time(format, 25), 6.5104, 0.0001);
    expect_milliseconds(wire_time(format, 255), 66.4062, 0.0001);
    EXPECT_EQ(silent_interval(format), 1750us);
}

TEST(SerialFormat, ComputesTheSilenceFromTheRealCharacterAtLowRates) {
    EXPECT_LT(silent_interval(plain(9600)), silent_interval(even(9600)));
    EXPECT_EQ(silent_interval(even(19201)), 1750us);
}

TEST(SerialFormat, SpendsNoTimeOnNoCharacters) { EXPECT_EQ(wire_time(even(9600), 0), 0ns); }

TEST(SerialFormat, CountsStartDataParityAndStopBits) {
    EXPECT_EQ((SerialFormat{9600, 8, Parity::even, 1}).bits_per_character(), 11);
    EXPECT_EQ((SerialFormat{9600, 8, Parity::none, 2}).bits_per_character(), 11);
    EXPECT_EQ((SerialFormat{9600, 8, Parity::none, 1}).bits_per_character(), 10);
    EXPECT_EQ((SerialFormat{9600, 7, Parity::odd, 1}).bits_per_character(), 10);
}

TEST(SerialFormat, IsTheStandardsByDefault) { EXPECT_EQ(to_string(SerialFormat()), "19200 8E1"); }

TEST(SerialFormat, IsWrittenAsPeopleWriteIt) {
    EXPECT_EQ(to_string(plain(38400)), "38400 8N1");
    EXPECT_EQ(to_string({9600, 8, Parity::odd, 2}), "9600 8O2");
    EXPECT_EQ(to_string({9600, 7, Parity::even, 1, SerialMode::ascii}), "9600 7E1 ASCII");
}

TEST(SerialFormat, AFrameOfAsciiTakesTwoCharactersAByteAndOneBesides) {
    const SerialFormat rtu{9600, 8, Parity::even, 1};
    const SerialFormat ascii{9600, 7, Parity::even, 1, SerialMode::ascii};
    EXPECT_EQ(frame_time(rtu, 8), wire_time(rtu, 8));
    EXPECT_EQ(frame_time(ascii, 8), wire_time(ascii, 17));
    EXPECT_EQ(frame_time(ascii, 8 + 11, 2), wire_time(ascii, 17 + 23));
    EXPECT_EQ(byte_time(rtu), character_time(rtu));
    EXPECT_EQ(byte_time(ascii), wire_time(ascii, 2));
}

TEST(SerialFormat, AsciiLeavesTimeToTurnRoundOnly) {
    const SerialFormat slow{1200, 7, Parity::even, 1, SerialMode::ascii};
    const SerialFormat fast{115200, 7, Parity::even, 1, SerialMode::ascii};
    EXPECT_EQ(silent_interval(slow), wire_time(slow, 2));
    EXPECT_EQ(silent_interval(fast), 1ms);
}

}  // namespace
}  // namespace panelgate::serial_format_test
