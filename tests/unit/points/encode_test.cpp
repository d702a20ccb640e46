#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "panelgate/points/value.hpp"
#include "point_of.hpp"

namespace panelgate::points::encode_test {
namespace {

Point scaled(Type type, double scale) {
    Point point = point_of(type);
    point.scale = scale;
    return point;
}

std::string refused(const Point& point, const Value& value, Rounding rounding = Rounding::exact) {
    const auto encoded = encode(point, value, rounding);
    if (encoded) return "accepted";
    EXPECT_EQ(encoded.error().inexact,
              encoded.error().message.find("cannot be exactly") != std::string::npos);
    return encoded.error().message;
}

TEST(Encode, WhatHasNoRawNumberIsRefusedWithTheNearest) {
    EXPECT_EQ(refused(point_of(Type::u64), 1.5),
              "x cannot be exactly 1.5 (u64); the nearest that it can be are 1 and 2");
    EXPECT_EQ(refused(scaled(Type::i16, 0.1), 21.55),
              "x cannot be exactly 21.55 (i16, scale 0.1); the nearest that it can be are 21.5 and "
              "21.6");
    EXPECT_EQ(refused(scaled(Type::i16, -0.1), -21.55),
              "x cannot be exactly -21.55 (i16, scale -0.1); the nearest that it can be are -21.6 "
              "and -21.5");
    EXPECT_EQ(refused(point_of(Type::u16), -0.25),
              "x cannot be exactly -0.25 (u16); the nearest that it can be is 0");
    EXPECT_EQ(refused(point_of(Type::bcd16), 9998.5),
              "x cannot be exactly 9998.5 (bcd16); the nearest that it can be are 9998 and 9999");
}

TEST(Encode, ADecimalThatIsNoBinaryFractionIsExact) {
    EXPECT_EQ(encode(scaled(Type::i16, 0.1), 21.5).value(), Words{215});
    EXPECT_EQ(encode(scaled(Type::i16, 0.1), 0.3).value(), Words{3});
    EXPECT_EQ(encode(scaled(Type::u16, 0.001), 32.767).value(), Words{32767});
    EXPECT_EQ(encode(scaled(Type::u16, 0.1), std::int64_t{21}).value(), Words{210});
    EXPECT_EQ(encode(point_of(Type::u16), 10.0).value(), Words{10});
}

TEST(Encode, RoundsWhenItIsTold) {
    EXPECT_EQ(encode(point_of(Type::u64), 1.5, Rounding::nearest).value(), (Words{0, 0, 0, 2}));
    EXPECT_EQ(encode(scaled(Type::i16, 0.1), 21.54, Rounding::nearest).value(), Words{215});
    EXPECT_EQ(encode(point_of(Type::bcd16), 12.3, Rounding::nearest).value(), Words{0x0012});
}

TEST(Encode, LimitsAreJudgedOnWhatIsWritten) {
    Point point = scaled(Type::u16, 10);
    point.max = 25;
    EXPECT_EQ(refused(point, std::int64_t{25}),
              "x cannot be exactly 25 (u16, scale 10); the nearest that it can be is 20");
    EXPECT_EQ(encode(point, std::int64_t{25}, Rounding::nearest).value(), Words{2});
    EXPECT_EQ(encode(point, std::int64_t{24}, Rounding::nearest).value(), Words{2});
    point.min = 24;
    EXPECT_EQ(refused(point, std::int64_t{24}, Rounding::nearest),
              "x must be from 24 to 25; 24 would be written as 20");
    EXPECT_EQ(refused(point, std::int64_t{24}),
              "x must be from 24 to 25; 24 would be written as 20")
        << "no rounding would do";
    point = scaled(Type::u16, 0.3);
    point.min = point.max = 0.9;
    EXPECT_EQ(encode(point, 0.9).value(), Words{3}) << "three tenths thrice are nine tenths";
}

TEST(Encode, AFractionTakesTheNearestFloatAndAWholeNumberIsMeantExactly) {
    const Point point = point_of(Type::f32);
    EXPECT_EQ(encode(point, 0.1).value(), (Words{0x3DCC, 0xCCCD}));
    EXPECT_EQ(decode(point, encode(point, 0.1).value()), Value(0.1));
    EXPECT_EQ(decode(point, encode(point, 64.0 / 3).value()), Value(21.333334));
    EXPECT_EQ(encode(point, std::int64_t{16777216}).value(), (Words{0x4B80, 0}));
    EXPECT_EQ(refused(point, std::int64_t{16777217}),
              "x cannot be exactly 16777217 (f32); the nearest that it can be are 16777216 and "
              "16777218");
    EXPECT_EQ(encode(point, std::int64_t{16777217}, Rounding::nearest).value(), (Words{0x4B80, 0}));
    Point limited = point;
    limited.max = 0.1;
    EXPECT_EQ(encode(limited, 0.1).value(), (Words{0x3DCC, 0xCCCD})) << "though 0.1F is a bit more";
    EXPECT_EQ(encode(scaled(Type::f32, 10), 1.0).value(), (Words{0x3DCC, 0xCCCD}));
}

TEST(Encode, WholeNumbersStayExactWithAScaleToo) {
    const std::int64_t whole = 1234567890123456780;
    EXPECT_EQ(encode(scaled(Type::i64, 10), whole).value(),
              (Words{0x01B6, 0x9B4B, 0xA630, 0xF34E}));
}

}  // namespace
}  // namespace panelgate::points::encode_test
