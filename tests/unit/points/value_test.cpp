#include "panelgate/points/value.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "point_of.hpp"

namespace panelgate::points::value_test {
namespace {

struct Vector {
    const char* name;
    Type type;
    WordOrder order;
    Words words;
    Value value;
};

const Vector kVectors[] = {
    {"u16", Type::u16, WordOrder::abcd, {0x1234}, std::int64_t{0x1234}},
    {"u16_swapped", Type::u16, WordOrder::badc, {0x3412}, std::int64_t{0x1234}},
    {"u16_dcba", Type::u16, WordOrder::dcba, {0x3412}, std::int64_t{0x1234}},
    {"i16", Type::i16, WordOrder::abcd, {0xFFFE}, std::int64_t{-2}},
    {"i16_swapped", Type::i16, WordOrder::badc, {0xFEFF}, std::int64_t{-2}},
    {"u32_abcd", Type::u32, WordOrder::abcd, {0x0102, 0x0304}, std::int64_t{0x01020304}},
    {"u32_cdab", Type::u32, WordOrder::cdab, {0x0304, 0x0102}, std::int64_t{0x01020304}},
    {"u32_badc", Type::u32, WordOrder::badc, {0x0201, 0x0403}, std::int64_t{0x01020304}},
    {"u32_dcba", Type::u32, WordOrder::dcba, {0x0403, 0x0201}, std::int64_t{0x01020304}},
    {"i32_cdab", Type::i32, WordOrder::cdab, {0xFFFF, 0xFFFF}, std::int64_t{-1}},
    {"u64_abcd",
     Type::u64,
     WordOrder::abcd,
     {0xFFFF, 0xFFFF, 0xFFFF, 0xFFFE},
     std::uint64_t{0xFFFFFFFFFFFFFFFE}},
    {"u64_dcba",
     Type::u64,
     WordOrder::dcba,
     {0x0807, 0x0605, 0x0403, 0x0201},
     std::uint64_t{0x0102030405060708}},
    {"i64_cdab",
     Type::i64,
     WordOrder::cdab,
     {0x0708, 0x0506, 0x0304, 0x0102},
     std::int64_t{0x0102030405060708}},
    {"f32_abcd", Type::f32, WordOrder::abcd, {0x41AC, 0x0000}, 21.5},
    {"f32_tenth", Type::f32, WordOrder::abcd, {0x3DCC, 0xCCCD}, 0.1},
    {"f32_most", Type::f32, WordOrder::abcd, {0x7F7F, 0xFFFF}, 3.4028235e38},
    {"f32_whole", Type::f32, WordOrder::abcd, {0x4F00, 0x0000}, 2147483648.0},
    {"f32_cdab", Type::f32, WordOrder::cdab, {0x0000, 0x41AC}, 21.5},
    {"f32_badc", Type::f32, WordOrder::badc, {0xAC41, 0x0000}, 21.5},
    {"f32_dcba", Type::f32, WordOrder::dcba, {0x0000, 0xAC41}, 21.5},
    {"f64_abcd", Type::f64, WordOrder::abcd, {0x4035, 0x8000, 0x0000, 0x0000}, 21.5},
    {"f64_badc", Type::f64, WordOrder::badc, {0x3540, 0x0080, 0x0000, 0x0000}, 21.5},
    {"bcd16", Type::bcd16, WordOrder::abcd, {0x1234}, std::int64_t{1234}},
    {"bcd32_cdab", Type::bcd32, WordOrder::cdab, {0x5678, 0x1234}, std::int64_t{12345678}},
    {"string", Type::string, WordOrder::abcd, {0x4142, 0x4344, 0x4500}, std::string("ABCDE")},
    {"string_badc", Type::string, WordOrder::badc, {0x4241, 0x4443, 0x0045}, std::string("ABCDE")},
    {"string_cdab_keeps_its_words",
     Type::string,
     WordOrder::cdab,
     {0x4142, 0x4344, 0x4500},
     std::string("ABCDE")},
    {"bool", Type::boolean, WordOrder::abcd, {0x0001}, true},
};

class Vectors : public testing::TestWithParam<Vector> {};

TEST_P(Vectors, DecodeAndEncode) {
    const Vector& v = GetParam();
    const Point point = point_of(v.type, v.order);
    EXPECT_EQ(decode(point, v.words), v.value);
    const auto encoded = encode(point, v.value);
    ASSERT_TRUE(encoded.has_value()) << encoded.error().message;
    EXPECT_EQ(*encoded, v.words);
}
INSTANTIATE_TEST_SUITE_P(Values, Vectors, testing::ValuesIn(kVectors),
                         [](const auto& info) { return info.param.name; });

TEST(Value, EveryTypeAndOrderRoundTrips) {
    std::mt19937_64 random(7);
    for (const Type type : kTypes) {
        if (type == Type::string || type == Type::boolean) continue;
        for (const WordOrder order : kOrders) {
            const Point point = point_of(type, order);
            for (int i = 0; i < 2000; ++i) {
                Words words(point.count());
                for (auto& word : words) word = static_cast<std::uint16_t>(random());
                const auto value = decode(point, words);
                if (!value) continue;  // invalid BCD, not a finite number
                const auto encoded = encode(point, *value);
                ASSERT_TRUE(encoded.has_value()) << label(type) << encoded.error().message;
                ASSERT_EQ(*encoded, words) << label(type) << ' ' << label(order);
            }
        }
    }
}

TEST(Value, ScaleAndOffsetAreInverted) {
    Point point = point_of(Type::i16);
    point.scale = 0.1;
    point.offset = -5;
    EXPECT_EQ(std::get<double>(*decode(point, Words{0x0109})), 21.5);
    for (int raw = -32768; raw <= 32767; raw += 7) {
        const Words words{static_cast<std::uint16_t>(raw)};
        EXPECT_EQ(*encode(point, *decode(point, words)), words);
    }
    EXPECT_EQ(encode(point, 21.4601, Rounding::nearest)->front(), 265);
}

TEST(Value, SentinelsBadDigitsAndNumbersThatAreNoneGiveNothing) {
    Point point = point_of(Type::i16);
    point.no_value = {-32768, 32767};
    EXPECT_FALSE(decode(point, Words{0x8000}));
    EXPECT_FALSE(decode(point, Words{0x7FFF}));
    EXPECT_TRUE(decode(point, Words{0x7FFE}));
    EXPECT_FALSE(decode(point_of(Type::bcd16), Words{0x12A4}));
    EXPECT_FALSE(decode(point_of(Type::f32), Words{0x7FC0, 0}));
    EXPECT_FALSE(decode(point_of(Type::f32), Words{0x7F80, 0}));
    EXPECT_FALSE(decode(point_of(Type::u32), Words{1})) << "too short";
}

TEST(Value, WhatDoesNotFitIsRefusedWithTheRange) {
    const auto refused = [](const Point& point, const Value& value) {
        const auto encoded = encode(point, value);
        return encoded ? std::string("accepted") : encoded.error().message;
    };
    Point point = point_of(Type::u16);
    EXPECT_EQ(refused(point, std::int64_t{65536}), "x must be from 0 to 65535 (u16), not 65536");
    EXPECT_EQ(refused(point, std::int64_t{-1}), "x must be from 0 to 65535 (u16), not -1");
    EXPECT_EQ(refused(point, std::numeric_limits<double>::quiet_NaN()),
              "x takes finite numbers only");
    EXPECT_EQ(refused(point, std::string("on")), "x takes a number, not the text 'on'");
    point.min = 0;
    point.max = 400;
    EXPECT_EQ(refused(point, 400.5), "x must be from 0 to 400, not 400.5");
    point.max.reset();
    EXPECT_EQ(refused(point, -0.5), "x must be at least 0, not -0.5");
    EXPECT_EQ(refused(point_of(Type::bcd16), std::int64_t{10000}),
              "x must be from 0 to 9999 (bcd16), not 10000");
    EXPECT_EQ(refused(point_of(Type::string), std::string("ABCDEFG")),
              "x holds 6 characters, not 7");
    EXPECT_EQ(refused(point_of(Type::string), true), "x takes a text");
    EXPECT_EQ(refused(point_of(Type::f32), 1e39),
              "x must be from -3.4028235e+38 to 3.4028235e+38 (f32), not 1e+39");
}

TEST(Value, LabelsNameRawValues) {
    Point point = point_of(Type::u16);
    point.labels = {{0, "stopped"}, {1, "running"}};
    EXPECT_EQ(label_of(point, Words{1}), "running");
    EXPECT_FALSE(label_of(point, Words{2}));
    EXPECT_EQ(encode(point, std::string("running"))->front(), 1);
}

TEST(Value, ABitOfAWord) {
    Point point = point_of(Type::boolean);
    point.bit = 3;
    EXPECT_EQ(decode(point, Words{0x0008}), Value(true));
    EXPECT_EQ(decode(point, Words{0xFFF7}), Value(false));
}

}  // namespace
}  // namespace panelgate::points::value_test
