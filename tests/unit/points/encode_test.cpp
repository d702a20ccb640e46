#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/decimal.hpp"
#include "panelgate/points/point.hpp"
#include "point_of.hpp"

namespace panelgate::points::encode_test {
namespace {

using namespace std::string_literals;
using enum Type;

constexpr Rounding kNearest = Rounding::nearest;
constexpr std::uint64_t kMostU64 = std::numeric_limits<std::uint64_t>::max();
constexpr std::int64_t kLeastI64 = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kOdd = 9007199254740993;  // 2^53 + 1: no double

Decimal of(const char* text) { return Decimal::parse(text).value(); }

Point labelled(Point point, std::map<std::int64_t, std::string> labels) {
    point.labels = std::move(labels);
    return point;
}

/// Returns the raw number, followed by the value shown where that differs; or the refusal.
std::string written(const Point& point, const Value& value, Rounding rounding) {
    const auto words = encode(point, value, rounding);
    if (!words) {
        const std::string& message = words.error().message;
        EXPECT_EQ(words.error().inexact, message.find("cannot be exactly") != message.npos);
        return message;
    }
    Point plain = point;
    plain.scale = 1;
    plain.offset = 0;
    const std::string raw = to_string(*decode(plain, *words));
    const std::string shown = to_string(*decode(point, *words));
    return raw == shown ? raw : raw + " told " + shown;
}

/// "x must be ..." is any text that begins like this, "accepted" any raw number.
struct Row {
    Point point;
    Value value;
    std::string written;
    Rounding rounding = Rounding::exact;
};

void expect_written(const std::vector<Row>& rows) {
    for (const Row& row : rows) {
        const std::string text = written(row.point, row.value, row.rounding);
        const bool whole = !row.written.ends_with("...");
        const std::string wanted = row.written.substr(0, row.written.size() - (whole ? 0u : 3u));
        if (wanted == "accepted") {
            EXPECT_FALSE(text.starts_with("x ")) << text;
        } else {
            EXPECT_EQ(whole ? text : text.substr(0, wanted.size()), wanted)
                << label(row.point.type) << ' ' << to_string(row.value);
        }
    }
}

/// Refused as "x cannot be exactly GIVEN; the nearest that it can be NEAREST".
struct Inexact {
    Point point;
    Value value;
    std::string given;
    std::string nearest;
};

TEST(Encode, WhatHasNoRawNumberIsRefusedWithTheNearest) {
    const Inexact rows[] = {
        {point_of(u64), 1.5, "1.5 (u64)", "are 1 and 2"},
        {scaled(i16, 0.1), 21.55, "21.55 (i16, scale 0.1)", "are 21.5 and 21.6"},
        {scaled(i16, -0.1), -21.55, "-21.55 (i16, scale -0.1)", "are -21.6 and -21.5"},
        {point_of(u16), -0.25, "-0.25 (u16)", "is 0"},
        {point_of(bcd16), 9998.5, "9998.5 (bcd16)", "are 9998 and 9999"},
        // Within the limits.
        {limited(scaled(u16, 10), {}, 25), 25, "25 (u16, scale 10)", "is 20"},
        {limited(scaled(u16, 0.1), {}, 25), of("25.04"), "25.04 (u16, scale 0.1)", "is 25"},
        // A fraction of many digits is no whole number.
        {point_of(i64), of("4503599627370497.3"), "4503599627370497.3 (i64)",
         "are 4503599627370497 and 4503599627370498"},
        {point_of(u32), of("1234567.00000000001"), "1234567.00000000001 (u32)",
         "are 1234567 and 1234568"},
        {point_of(u16), of("99.99999999999999999999"), "99.99999999999999999999 (u16)",
         "are 99 and 100"},
        // A float takes a fraction only where it has fractions, and a whole number exactly.
        {point_of(f32), 16777217, "16777217 (f32)", "are 16777216 and 16777218"},
        {point_of(f32), of("16777217.5"), "16777217.5 (f32)", "are 16777216 and 16777218"},
        {point_of(f64), kOdd, "9007199254740993 (f64)",
         "are 9007199254740992 and 9007199254740994"},
        {point_of(f64), of("4503599627370497.3"), "4503599627370497.3 (f64)",
         "are 4503599627370497 and 4503599627370498"},
        // What is not 0 is not written as 0.
        {point_of(f32), 1e-308, "1e-308 (f32)", "are 0 and 1e-45"},
    };
    for (const Inexact& row : rows)
        EXPECT_EQ(
            written(row.point, row.value, Rounding::exact),
            "x cannot be exactly " + row.given + "; the nearest that it can be " + row.nearest);
}

TEST(Encode, ADecimalThatIsNoBinaryFractionIsExactAndOthersAreRoundedWhenItIsTold) {
    expect_written({
        {scaled(i16, 0.1), 21.5, "215 told 21.5"},
        {scaled(i16, 0.1), 0.3, "3 told 0.3"},
        {scaled(u16, 0.001), 32.767, "32767 told 32.767"},
        {scaled(u16, 0.1), 21, "210 told 21"},
        {scaled(i16, 0.1), -0.3, "-3 told -0.3"},
        {scaled(i16, 0.1), -0.0, "0"},
        {scaled(i16, 0.1, -5), 21.5, "265 told 21.5"},
        {scaled(i16, -0.25), 0.75, "-3 told 0.75"},
        {scaled(u16, 10, 5), 25.0, "2 told 25"},
        {scaled(u16, 1e6), 3e6, "3 told ..."},
        {scaled(u16, 1, 0.5), 2.0, "x cannot be exactly..."},
        // The digits with which some write every double; those too far apart are rounded.
        {scaled(u16, 0.1), of("0.29999999999999999"), "3 told 0.3"},
        {scaled(u16, 0.1), of("0.299999999999999990001"), "x cannot be exactly..."},
        {scaled(u16, 1e15, 1e-15), 3e15, "3 told ..."},
        {scaled(u16, 1e15, 1e-15), 3.5e15, "x cannot be exactly..."},
        {point_of(u16), 10.0, "10"},
        {point_of(u64), 1.5, "2", kNearest},
        {scaled(i16, 0.1), 21.54, "215 told 21.5", kNearest},
        {scaled(i16, 0.1, -5), 21.4601, "265 told 21.5", kNearest},
        {point_of(bcd16), 12.3, "12", kNearest},
        {point_of(u64), of("9007199254740993.4"), "9007199254740993", kNearest},
        {point_of(u64), of("18446744073709551614.4"), "18446744073709551614", kNearest},
        {point_of(u64), of("18446744073709551615.4"), "18446744073709551615", kNearest},
        {point_of(i64), of("9223372036854775807.4"), "9223372036854775807", kNearest},
        {point_of(i64), of("-9007199254740993.5"), "-9007199254740994", kNearest},
    });
}

TEST(Encode, WholeNumbersKeepTheirDigitsWithScaleAndOffset) {
    expect_written({
        {point_of(u64), kMostU64, "18446744073709551615"},
        {point_of(i64), kLeastI64, "-9223372036854775808"},
        {point_of(i64), kOdd, "9007199254740993"},
        {scaled(i64, 10), 1234567890123456780, "123456789012345678 told 1234567890123456780"},
        {scaled(i64, 10), 1234567890123456789, "x cannot be exactly..."},
        {scaled(i64, 10), kLeastI64, "x cannot be exactly..."},
        {scaled(i64, 10), 70, "7 told 70"},
        {scaled(i64, 0.1), 1e300, "x must be..."},
        {scaled(u64, 10), kMostU64, "x ..."},  // it ends with a 5
        {scaled(u64, 0.001), of("9007199254740.993"), "9007199254740993 told 9007199254740.993"},
        {scaled(i64, 0.01), of("90071992547409.93"), "9007199254740993 told 90071992547409.93"},
        {scaled(i64, 0.01), of("90071992547409.935"), "x cannot be exactly..."},
        {scaled(i64, 0.01), 90071992547410, "accepted"},
        {scaled(i64, 0.01), 9007199254740.93, "accepted"},
        {scaled(u64, 1, 1), of("9007199254740994"), "9007199254740993 told 9007199254740994"},
        {scaled(u64, 1, 1), of("18446744073709551615"),
         "18446744073709551614 told 18446744073709551615"},
        {scaled(i64, 2), of("18014398509481986"), "9007199254740993 told 18014398509481986"},
        {scaled(i64, 2), of("9223372036854775806"), "4611686018427387903 told 9223372036854775806"},
        {scaled(i64, 2), of("-18446744073709551616"),
         "-9223372036854775808 told -18446744073709551616"},
    });
}

TEST(Encode, AFractionTakesTheNearestFloatAndAWholeNumberIsMeantExactly) {
    const Point point = point_of(f32);
    EXPECT_EQ(encode(scaled(f32, 10), 1.0).value(), (Words{0x3DCC, 0xCCCD}));
    EXPECT_EQ(decode(point, encode(point, 64.0 / 3).value()), Value(21.333334));
    expect_written({
        {point, 0.1, "0.1"},
        {limited(point, {}, 0.1), 0.1, "0.1"},  // though 0.1F is a bit more
        {point, of("1234567.3"), "1234567.2"},
        {point, 16777216, "16777216"},
        {point, 16777217, "16777216", kNearest},
        {point, of("16777217.5"), "16777218", kNearest},
        {point_of(Type::f16), 0.1, "0.099975586"},
        {point_of(Type::f16), 2049,
         "x cannot be exactly 2049 (f16); the nearest that it can be is 2048"},
        {point_of(Type::f16), 2049, "2048", kNearest},
        {point_of(Type::f16), 1e-6, "x ..."},
        {point, kOdd, "x cannot be exactly 9007199254740993..."},
        {point, -2e-45, "x ..."},    // half of it would be lost
        {point, 1e-45, "accepted"},  // as it is shown
        {point, 1.1e-37, "accepted"},
        {point, 1e-308, "0", kNearest},
        {point_of(f64), 5e-324, "accepted"},
        {point_of(f64), kOdd - 1, "accepted"},
        {point_of(f64), std::uint64_t{9223372036854776000u}, "accepted"},  // as 2^63 is shown
        {point_of(f64), kOdd, "accepted", kNearest},
        {point_of(f64), of("0.1000000000000000055511151231257827"), "0.1"},
        {point_of(f64), of("18446744073709551616"), "1.8446744073709552e+19"},
    });
}

TEST(Encode, WhatDoesNotFitTheTypeIsRefusedWithTheRangeInTheUnitOfTheValue) {
    const std::string i64_range =
        "x must be from -9223372036854775808 to 9223372036854775807 (i64), not ";
    expect_written({
        {point_of(u16), 65536, "x must be from 0 to 65535 (u16), not 65536"},
        {point_of(u16), -1, "x must be from 0 to 65535 (u16), not -1"},
        {point_of(Type::u8h), 256, "x must be from 0 to 255 (u8h), not 256"},
        {point_of(Type::i48), std::int64_t{1} << 47,
         "x must be from -140737488355328 to 140737488355327 (i48), not 140737488355328"},
        {point_of(Type::f16), 70000, "x must be from -65504 to 65504 (f16), not 70000"},
        {point_of(bcd16), 10000, "x must be from 0 to 9999 (bcd16), not 10000"},
        {point_of(f32), 1e39, "x must be from -3.4028235e+38 to 3.4028235e+38 (f32), not 1e+39"},
        {scaled(i16, 0.1), 4000, "x must be from -3276.8 to 3276.7 (i16, scale 0.1), not 4000"},
        {scaled(i16, -2, 10), 70000,
         "x must be from -65524 to 65546 (i16, scale -2, offset 10), not 70000"},
        {point_of(u64), -1, "x must be from 0 to 18446744073709551615 (u64), not -1"},
        {point_of(u64), 18446744073709551616.0, "x ..."},
        {point_of(i64), std::uint64_t{1} << 63, i64_range + "9223372036854775808"},
        {point_of(i64), 9223372036854775808.0, "x ..."},
        // Also when they may be rounded.
        {point_of(i64), of("-9223372036854775809"), i64_range + "-9223372036854775809"},
        {point_of(i64), of("-9223372036854775809"), i64_range + "-9223372036854775809", kNearest},
        {scaled(u64, 10), of("184467440737095516155"),
         "x must be from 0 to 184467440737095516150 (u64, scale 10), not 184467440737095516155",
         kNearest},
    });
}

TEST(Encode, AConfiguredLimitIsJudgedOnWhatIsWritten) {
    const Point tenths = limited(scaled(u16, 0.1), {}, 25);
    const Point tens = limited(scaled(u16, 10), {}, 25);
    const Point narrow = limited(scaled(u16, 10), 24, 25);
    const Point real = limited(point_of(f32), {}, 16777216);
    expect_written({
        {limited(point_of(u16), 0, 400), 400.5, "x must be from 0 to 400, not 400.5"},
        {limited(point_of(u16), 0, {}), -0.5, "x must be at least 0, not -0.5"},
        {tenths, of("25.04"), "250 told 25", kNearest},
        {tenths, of("25.06"), "x must be at most 25, not 25.06", kNearest},
        {tenths, of("25.06"), "x must be at most 25, not 25.06"},
        {tens, 25, "2 told 20", kNearest},  // 30 would be as near, but may not be
        {tens, 24, "2 told 20", kNearest},
        {tens, of("25"), "2 told 20", kNearest},
        {tens, of("26"), "x must be at most 25, not 26", kNearest},
        {narrow, 24, "x must be from 24 to 25; 24 would be written as 20", kNearest},
        {narrow, 24, "x must be from 24 to 25; 24 would be written as 20"},  // no rounding would do
        {limited(scaled(u16, 0.3), 0.9, 0.9), 0.9, "3 told 0.9"},            // three tenths thrice
        {real, of("16777216.5"), "16777216", kNearest},
        {real, of("16777216.5"), "x must be at most 16777216, not 16777216.5"},
    });
}

TEST(Encode, LimitsOfSixtyFourBitsCountEveryDigit) {
    const Point least = limited(point_of(i64), of("-9223372036854775807"), {});
    const Point most = limited(point_of(u64), {}, of("18446744073709551614"));
    const Point odd = limited(point_of(i64), {}, of("9007199254740993"));
    const Point even = limited(point_of(i64), {}, 9007199254740992.0);
    const Point zero = limited(point_of(i64), -0.5, 0.5);
    expect_written({
        {least, of("-9223372036854775808"),
         "x must be at least -9223372036854775807, not -9223372036854775808"},
        {least, of("-9223372036854775807"), "-9223372036854775807"},
        {most, of("18446744073709551615"),
         "x must be at most 18446744073709551614, not 18446744073709551615"},
        {most, of("18446744073709551614"), "18446744073709551614"},
        {odd, of("9007199254740993"), "9007199254740993"},
        {odd, of("9007199254740994"), "x ..."},
        {even, kOdd, "x ..."},
        {even, kOdd - 1, "9007199254740992"},
        {zero, 0, "0"},
        {zero, 1, "x ..."},
        {zero, -1, "x ..."},
        {zero, kMostU64, "x ..."},
    });
}

TEST(Encode, ALabelStandsForItsRawNumberAndIsHeldAgainstTheSameLimits) {
    const Point point = labelled(point_of(u16), {{1, "one"}, {70000, "much"}});
    expect_written({
        {point, "much"s, "x must be from 0 to 65535 (u16), not 70000"},
        {point, "two"s, "x has no label 'two'; its labels are one, much"},
        {limited(point, {}, 0), "one"s, "x must be at most 0, not 1"},
        {labelled(point_of(bcd16), {{25, "quarter"}}), "quarter"s, "25"},
        {labelled(scaled(u16, 0.1), {{25, "quarter"}}), "quarter"s, "25 told 2.5"},
    });
}

TEST(Encode, TypesAreNotMixed) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    expect_written({
        {point_of(u16), true, "x takes a number, not true"},
        {point_of(u16), "on"s, "x takes a number, not the text 'on'"},
        {point_of(i16), "21.5"s, "x takes a number, not the text '21.5'"},
        {point_of(u16), kNan, "x takes finite numbers only"},
        {point_of(f64), kInfinity, "x takes finite numbers only"},
        {bit_of(3), "on"s, "x takes true or false, not the text 'on'"},
        {bit_of(3), 0.4, "x takes true or false, not 0.4"},
        {bit_of(3), 2, "x takes true or false, not 2"},
        {bit_of(3), of("1.00000000000000000001"),
         "x takes true or false, not 1.00000000000000000001"},
        {point_of(string), true, "x takes a text"},
        {text_of(6), "ABCDEFG"s, "x holds 6 characters, not 7"},
        {text_of(5), "a\0b"s, "x takes no text with a NUL: it would end there"},
        {text_of(5), "NaN"s, "NaN"},
        // What means no value cannot be written.
        {without(u16, {-1}), 65535, "x cannot be 65535: that means no value"},
        {without(u16, {-1}), 65534, "65534"},
        {without(f32, {-9999}), -9999.0, "x cannot be -9999: that means no value"},
        {without(bcd16, {9999}), 9999, "x cannot be 9999: that means no value"},
    });
    EXPECT_EQ(encode(bit_of(3), 1).value(), Words{1});
    EXPECT_EQ(encode(bit_of(3), 0.0).value(), Words{0});
    for (const std::string text : {"NaN", "-Infinity", "inf"}) {
        const auto encoded = encode(point_of(f32), text);
        ASSERT_FALSE(encoded);
        EXPECT_TRUE(encoded.error().malformed);
        EXPECT_EQ(encoded.error().message, "x takes finite numbers only, not '" + text + "'");
    }
}

}  // namespace
}  // namespace panelgate::points::encode_test
