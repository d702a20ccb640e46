#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "panelgate/base/decimal.hpp"
#include "panelgate/points/value.hpp"
#include "point_of.hpp"

namespace panelgate::points::exact_numbers_test {
namespace {

Decimal of(const char* text) { return Decimal::parse(text).value(); }

/// Returns the raw number, followed by the value shown where that differs; or the refusal.
std::string written(const Point& point, const char* number, Rounding rounding = Rounding::exact) {
    const auto words = encode(point, of(number), rounding);
    if (!words) return words.error().message;
    Point plain = point_of(point.type);
    const std::string raw = to_string(*decode(plain, *words));
    const std::string shown = to_string(*decode(point, *words));
    return raw == shown ? raw : raw + " told " + shown;
}

std::string rounded(const Point& point, const char* number) {
    return written(point, number, Rounding::nearest);
}

Point scaled(Type type, double scale, double offset = 0) {
    Point point = point_of(type);
    point.scale = scale;
    point.offset = offset;
    return point;
}

TEST(ExactNumbers, LimitsOfSixtyFourBitsCountEveryDigit) {
    Point point = point_of(Type::i64);
    point.min = of("-9223372036854775807");
    EXPECT_EQ(written(point, "-9223372036854775808"),
              "x must be at least -9223372036854775807, not -9223372036854775808");
    EXPECT_EQ(written(point, "-9223372036854775807"), "-9223372036854775807");
    point = point_of(Type::u64);
    point.max = of("18446744073709551614");
    EXPECT_EQ(written(point, "18446744073709551615"),
              "x must be at most 18446744073709551614, not 18446744073709551615");
    EXPECT_EQ(written(point, "18446744073709551614"), "18446744073709551614");
    point = point_of(Type::i64);
    point.max = of("9007199254740993");
    EXPECT_EQ(written(point, "9007199254740993"), "9007199254740993");
    EXPECT_NE(written(point, "9007199254740994"), "9007199254740994");
}

TEST(ExactNumbers, AFractionOfManyDigitsIsNoWholeNumber) {
    EXPECT_EQ(written(point_of(Type::i64), "4503599627370497.3"),
              "x cannot be exactly 4503599627370497.3 (i64); the nearest that it can be are "
              "4503599627370497 and 4503599627370498");
    EXPECT_EQ(written(point_of(Type::u32), "1234567.00000000001"),
              "x cannot be exactly 1234567.00000000001 (u32); the nearest that it can be are "
              "1234567 and 1234568");
    EXPECT_EQ(written(point_of(Type::u16), "99.99999999999999999999"),
              "x cannot be exactly 99.99999999999999999999 (u16); the nearest that it can be are "
              "99 and 100");
    Point bit = point_of(Type::boolean);
    bit.bit = 3;
    EXPECT_EQ(encode(bit, of("1.00000000000000000001")).error().message,
              "x takes true or false, not 1.00000000000000000001");
}

TEST(ExactNumbers, AreRoundedToTheNearest) {
    EXPECT_EQ(rounded(point_of(Type::u64), "9007199254740993.4"), "9007199254740993");
    EXPECT_EQ(rounded(point_of(Type::u64), "18446744073709551614.4"), "18446744073709551614");
    EXPECT_EQ(rounded(point_of(Type::u64), "18446744073709551615.4"), "18446744073709551615");
    EXPECT_EQ(rounded(point_of(Type::i64), "9223372036854775807.4"), "9223372036854775807");
    EXPECT_EQ(rounded(point_of(Type::i64), "-9007199254740993.5"), "-9007199254740994");
}

TEST(ExactNumbers, BeyondTheTypeAreRefusedAlsoWhenTheyMayBeRounded) {
    const Point point = point_of(Type::i64);
    const std::string refused =
        "x must be from -9223372036854775808 to 9223372036854775807 (i64), not "
        "-9223372036854775809";
    EXPECT_EQ(written(point, "-9223372036854775809"), refused);
    EXPECT_EQ(rounded(point, "-9223372036854775809"), refused);
    EXPECT_EQ(rounded(scaled(Type::u64, 10), "184467440737095516155"),
              "x must be from 0 to 184467440737095516150 (u64, scale 10), not "
              "184467440737095516155");
}

TEST(ExactNumbers, KeepTheirDigitsWithScaleAndOffset) {
    EXPECT_EQ(written(scaled(Type::u64, 0.001), "9007199254740.993"),
              "9007199254740993 told 9007199254740.993");
    EXPECT_EQ(written(scaled(Type::i64, 0.01), "90071992547409.93"),
              "9007199254740993 told 90071992547409.93");
    EXPECT_EQ(written(scaled(Type::u64, 1, 1), "9007199254740994"),
              "9007199254740993 told 9007199254740994");
    EXPECT_EQ(written(scaled(Type::u64, 1, 1), "18446744073709551615"),
              "18446744073709551614 told 18446744073709551615");
    const Point twice = scaled(Type::i64, 2);
    EXPECT_EQ(written(twice, "18014398509481986"), "9007199254740993 told 18014398509481986");
    EXPECT_EQ(written(twice, "9223372036854775806"),
              "4611686018427387903 told 9223372036854775806");
    EXPECT_EQ(written(twice, "-18446744073709551616"),
              "-9223372036854775808 told -18446744073709551616");
}

TEST(ExactNumbers, AFloatTakesAFractionOnlyWhereItHasFractions) {
    EXPECT_EQ(written(point_of(Type::f32), "16777217.5"),
              "x cannot be exactly 16777217.5 (f32); the nearest that it can be are 16777216 and "
              "16777218");
    EXPECT_EQ(rounded(point_of(Type::f32), "16777217.5"), "16777218");
    EXPECT_EQ(written(point_of(Type::f32), "1234567.3"), "1234567.2");
    EXPECT_EQ(written(point_of(Type::f64), "4503599627370497.3"),
              "x cannot be exactly 4503599627370497.3 (f64); the nearest that it can be are "
              "4503599627370497 and 4503599627370498");
    EXPECT_EQ(written(point_of(Type::f64), "0.1000000000000000055511151231257827"), "0.1");
    EXPECT_EQ(written(point_of(Type::f64), "18446744073709551616"), "1.8446744073709552e+19");
}

TEST(ExactNumbers, AConfiguredLimitIsJudgedOnWhatIsWritten) {
    Point point = scaled(Type::u16, 0.1);
    point.max = 25;
    EXPECT_EQ(rounded(point, "25.04"), "250 told 25");
    EXPECT_EQ(written(point, "25.04"),
              "x cannot be exactly 25.04 (u16, scale 0.1); the nearest that it can be is 25");
    EXPECT_EQ(rounded(point, "25.06"), "x must be at most 25, not 25.06");
    EXPECT_EQ(written(point, "25.06"), "x must be at most 25, not 25.06");
    point = scaled(Type::u16, 10);
    point.max = 25;
    EXPECT_EQ(rounded(point, "25"), "2 told 20") << "30 would be as near, but may not be";
    EXPECT_EQ(rounded(point, "26"), "x must be at most 25, not 26");
    point = point_of(Type::f32);
    point.max = 16777216;
    EXPECT_EQ(rounded(point, "16777216.5"), "16777216");
    EXPECT_EQ(written(point, "16777216.5"), "x must be at most 16777216, not 16777216.5");
}

}  // namespace
}  // namespace panelgate::points::exact_numbers_test
