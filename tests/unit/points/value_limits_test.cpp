#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "panelgate/base/decimal.hpp"
#include "panelgate/points/value.hpp"
#include "point_of.hpp"

namespace panelgate::points::value_limits_test {
namespace {

Point text_of_five() {
    Point point = point_of(Type::string);
    point.length = 5;
    return point;
}

std::string refused(const Point& point, const Value& value) {
    const auto encoded = encode(point, value);
    return encoded ? "accepted" : encoded.error().message;
}

constexpr std::uint64_t kMostU64 = std::numeric_limits<std::uint64_t>::max();
constexpr std::int64_t kLeastI64 = std::numeric_limits<std::int64_t>::min();

TEST(Value, ALabelIsHeldAgainstTheSameLimitsAsItsNumber) {
    Point point = point_of(Type::u16);
    point.labels = {{1, "one"}, {70000, "much"}};
    EXPECT_EQ(refused(point, std::string("much")), "x must be from 0 to 65535 (u16), not 70000");
    EXPECT_EQ(refused(point, std::string("two")), "x has no label 'two'; its labels are one, much");
    point.max = 0;
    EXPECT_EQ(refused(point, std::string("one")), "x must be at most 0, not 1");
}

TEST(Value, ALabelStandsForTheRawNumberAlsoOfBcdAndWithAScale) {
    Point point = point_of(Type::bcd16);
    point.labels = {{25, "quarter"}};
    EXPECT_EQ(*encode(point, std::string("quarter")), Words{0x0025});
    point = point_of(Type::u16);
    point.scale = 0.1;
    point.labels = {{25, "quarter"}};
    EXPECT_EQ(*encode(point, std::string("quarter")), Words{25});
}

TEST(Value, NoValueCountsTheBitsOfTheType) {
    Point point = point_of(Type::u16);
    point.no_value = {-1};
    EXPECT_FALSE(decode(point, Words{0xFFFF}));
    EXPECT_TRUE(decode(point, Words{0xFFFE}));
    point = point_of(Type::i16);
    point.no_value = {65535, 32768};
    EXPECT_FALSE(decode(point, Words{0xFFFF}));
    EXPECT_FALSE(decode(point, Words{0x8000}));
    point = point_of(Type::u64);
    point.no_value = {-1};
    EXPECT_FALSE(decode(point, Words{0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF}));
    EXPECT_TRUE(decode(point, Words{0, 0, 0, 0xFFFF}));
}

TEST(Value, NoValueOfAFloatIsItsNumberBeforeTheScale) {
    Point point = point_of(Type::f32);
    point.scale = 2;
    point.no_value = {-9999};
    EXPECT_FALSE(decode(point, Words{0xC61C, 0x3C00}));
    EXPECT_EQ(decode(point, Words{0xC61C, 0x4000}), Value(-20000.0));
}

TEST(Value, WhatMeansNoValueCannotBeWritten) {
    Point point = point_of(Type::u16);
    point.no_value = {-1};
    EXPECT_EQ(refused(point, std::int64_t{65535}), "x cannot be 65535: that means no value");
    EXPECT_EQ(refused(point, std::int64_t{65534}), "accepted");
    point = point_of(Type::f32);
    point.no_value = {-9999};
    EXPECT_EQ(refused(point, -9999.0), "x cannot be -9999: that means no value");
    point = point_of(Type::bcd16);
    point.no_value = {9999};
    EXPECT_FALSE(decode(point, Words{0x9999}));
    EXPECT_EQ(refused(point, std::int64_t{9999}), "x cannot be 9999: that means no value");
}

TEST(Value, ADecimalScaleGivesTheNearestDecimalNumber) {
    Point point = point_of(Type::i16);
    point.scale = 0.1;
    EXPECT_EQ(decode(point, Words{3}), Value(0.3)) << "not 0.30000000000000004";
    point.scale = 0.01;
    for (int raw = -32768; raw <= 32767; ++raw) {
        const auto value = std::get<double>(*decode(point, Words{static_cast<std::uint16_t>(raw)}));
        ASSERT_EQ(value, std::stod(std::to_string(raw) + "e-2"));
    }
}

TEST(Value, SixtyFourBitsAreExactUpToTheirEnds) {
    const Point wide = point_of(Type::u64);
    EXPECT_EQ(*encode(wide, kMostU64), (Words{0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF}));
    EXPECT_EQ(decode(wide, *encode(wide, kMostU64)), Value(kMostU64));
    EXPECT_EQ(refused(wide, std::int64_t{-1}),
              "x must be from 0 to 18446744073709551615 (u64), not -1");
    EXPECT_NE(refused(wide, 18446744073709551616.0), "accepted");
    const Point narrow = point_of(Type::i64);
    EXPECT_EQ(*encode(narrow, kLeastI64), (Words{0x8000, 0, 0, 0}));
    EXPECT_EQ(refused(narrow, std::uint64_t{1} << 63),
              "x must be from -9223372036854775808 to 9223372036854775807 (i64), not "
              "9223372036854775808");
    EXPECT_NE(refused(narrow, 9223372036854775808.0), "accepted");
}

TEST(Value, AWholeNumberBeyondTheDigitsOfAFloatIsNotChanged) {
    const std::int64_t odd = 9007199254740993;  // 2^53 + 1
    EXPECT_EQ(refused(point_of(Type::f64), odd),
              "x cannot be exactly 9007199254740993 (f64); the nearest that it can be are "
              "9007199254740992 and 9007199254740994");
    EXPECT_EQ(refused(point_of(Type::f64), odd - 1), "accepted");
    EXPECT_EQ(refused(point_of(Type::f64), std::uint64_t{9223372036854776000u}), "accepted")
        << "as 2^63 is shown";
    EXPECT_EQ(refused(point_of(Type::f32), odd).substr(0, 36),
              "x cannot be exactly 9007199254740993");
    EXPECT_TRUE(encode(point_of(Type::f64), odd, Rounding::nearest));
    EXPECT_EQ(refused(point_of(Type::i64), odd), "accepted");
}

TEST(Value, LimitsHoldForNumbersThatNoDoubleIs) {
    Point point = point_of(Type::i64);
    point.max = 9007199254740992.0;
    EXPECT_NE(refused(point, std::int64_t{9007199254740993}), "accepted");
    EXPECT_EQ(refused(point, std::int64_t{9007199254740992}), "accepted");
    point.max = 0.5;
    point.min = -0.5;
    EXPECT_EQ(refused(point, std::int64_t{0}), "accepted");
    EXPECT_NE(refused(point, std::int64_t{1}), "accepted");
    EXPECT_NE(refused(point, std::int64_t{-1}), "accepted");
    EXPECT_NE(refused(point, kMostU64), "accepted");
}

TEST(Value, AScaledWholeNumberIsNotRoundedThroughADouble) {
    Point point = point_of(Type::u64);
    point.scale = 10;
    EXPECT_NE(refused(point, kMostU64), "accepted") << "ends with a 5";
    point = point_of(Type::i64);
    point.scale = 0.01;
    EXPECT_EQ(refused(point, *Decimal::parse("90071992547409.93")), "accepted");
    EXPECT_EQ(refused(point, *Decimal::parse("90071992547409.935")).substr(0, 19),
              "x cannot be exactly");
    EXPECT_EQ(refused(point, std::int64_t{90071992547410}), "accepted");
    EXPECT_EQ(refused(point, 9007199254740.93), "accepted");
}

TEST(Value, WhatIsNotZeroIsNotWrittenAsZero) {
    EXPECT_EQ(refused(point_of(Type::f32), 1e-308),
              "x cannot be exactly 1e-308 (f32); the nearest that it can be are 0 and 1e-45");
    EXPECT_NE(refused(point_of(Type::f32), -2e-45), "accepted") << "half of it would be lost";
    EXPECT_EQ(refused(point_of(Type::f32), 1e-45), "accepted") << "as it is shown";
    EXPECT_EQ(refused(point_of(Type::f32), 1.1e-37), "accepted");
    EXPECT_EQ(refused(point_of(Type::f64), 5e-324), "accepted");
    EXPECT_EQ(*encode(point_of(Type::f32), 1e-308, Rounding::nearest), (Words{0, 0}));
}

TEST(Value, ATextIsNoNumber) {
    EXPECT_EQ(refused(point_of(Type::i16), std::string("21.5")),
              "x takes a number, not the text '21.5'");
    Point bit = point_of(Type::boolean);
    bit.bit = 3;
    EXPECT_EQ(refused(bit, std::string("on")), "x takes true or false, not the text 'on'");
    for (const char* text : {"NaN", "-Infinity", "inf"}) {
        const auto encoded = encode(point_of(Type::f32), std::string(text));
        ASSERT_FALSE(encoded);
        EXPECT_TRUE(encoded.error().malformed);
        EXPECT_EQ(encoded.error().message,
                  "x takes finite numbers only, not '" + std::string(text) + "'");
    }
    EXPECT_EQ(refused(text_of_five(), std::string("NaN")), "accepted");
}

TEST(Value, TheRangeIsToldInTheUnitOfTheValue) {
    Point point = point_of(Type::i16);
    point.scale = 0.1;
    EXPECT_EQ(refused(point, std::int64_t{4000}),
              "x must be from -3276.8 to 3276.7 (i16, scale 0.1), not 4000");
    point.scale = -2;
    point.offset = 10;
    EXPECT_EQ(refused(point, std::int64_t{70000}),
              "x must be from -65524 to 65546 (i16, scale -2, offset 10), not 70000");
}

TEST(Value, TypesAreNotMixed) {
    EXPECT_EQ(refused(point_of(Type::u16), true), "x takes a number, not true");
    EXPECT_EQ(refused(point_of(Type::f64), std::numeric_limits<double>::infinity()),
              "x takes finite numbers only");
    Point bit = point_of(Type::boolean);
    bit.bit = 3;
    EXPECT_EQ(refused(bit, 0.4), "x takes true or false, not 0.4");
    EXPECT_EQ(refused(bit, std::int64_t{2}), "x takes true or false, not 2");
    EXPECT_EQ(*encode(bit, std::int64_t{1}), Words{1});
    EXPECT_EQ(*encode(bit, 0.0), Words{0});
}

TEST(Value, ATextIsAlwaysUtf8) {
    const Point point = text_of_five();
    EXPECT_EQ(decode(point, Words{0xFF41, 0x4200, 0}), Value(std::string("\xEF\xBF\xBD"
                                                                         "AB")));
    EXPECT_EQ(decode(point, Words{0xC3A9, 0xE282, 0xAC00}),
              Value(std::string("\xC3\xA9\xE2\x82\xAC")));
    EXPECT_EQ(decode(point, Words{0xC080, 0x4100, 0}), Value(std::string("\xEF\xBF\xBD\xEF\xBF\xBD"
                                                                         "A")))
        << "an overlong NUL";
    EXPECT_EQ(decode(point, Words{0xE282, 0, 0}), Value(std::string("\xEF\xBF\xBD\xEF\xBF\xBD")))
        << "cut off";
}

TEST(Value, ATextEndsAtItsLengthItsFirstNulAndBeforeItsPadding) {
    const Point point = text_of_five();
    EXPECT_EQ(decode(point, Words{0x4142, 0x4344, 0x4546}), Value(std::string("ABCDE")));
    EXPECT_EQ(decode(point, Words{0x4142, 0x0044, 0x4500}), Value(std::string("AB")));
    EXPECT_EQ(decode(point, Words{0x4120, 0x2020, 0x2020}), Value(std::string("A")));
    EXPECT_EQ(decode(point, Words{0, 0, 0}), Value(std::string()));
    EXPECT_EQ(refused(point, std::string("a\0b", 3)),
              "x takes no text with a NUL: it would end there");
}

TEST(Value, TextsRoundTripInEveryOrder) {
    std::mt19937_64 random(11);
    for (const WordOrder order : kOrders) {
        Point point = point_of(Type::string, order);
        for (int i = 0; i < 500; ++i) {
            point.length = 1 + static_cast<unsigned>(random() % 40);
            std::string text(random() % (point.length + 1), ' ');
            for (char& c : text) c = static_cast<char>('!' + random() % 90);
            const auto words = encode(point, text);
            ASSERT_TRUE(words.has_value());
            ASSERT_EQ(words->size(), (point.length + 1) / 2);
            ASSERT_EQ(decode(point, *words), Value(text));
        }
    }
}

TEST(Value, ScaledValuesRoundTripForEveryWholeTypeAndOrder) {
    std::mt19937_64 random(5);
    for (const Type type : {Type::u16, Type::i16, Type::u32, Type::i32, Type::bcd16, Type::bcd32}) {
        for (const WordOrder order : kOrders) {
            Point point = point_of(type, order);
            for (const double scale : {0.001, 0.1, 0.3, 1.0, 7.5, -0.25, -4.0}) {
                point.scale = scale;
                point.offset = static_cast<double>(random() % 2001) / 8 - 125;
                for (int i = 0; i < 200; ++i) {
                    Words words(point.count());
                    for (auto& word : words) word = static_cast<std::uint16_t>(random());
                    const auto value = decode(point, words);
                    if (!value) continue;  // invalid BCD
                    ASSERT_EQ(*encode(point, *value), words) << label(type) << " scale " << scale;
                }
            }
        }
    }
}

}  // namespace
}  // namespace panelgate::points::value_limits_test
