#include "panelgate/points/point.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "point_of.hpp"

namespace panelgate::points::value_test {
namespace {

using namespace std::string_literals;
using enum Type;
using enum WordOrder;

struct Vector {
    Type type;
    WordOrder order;
    Words words;
    Value value;
};

const Vector kVectors[] = {
    {u16, abcd, {0x1234}, 0x1234},
    {u16, badc, {0x3412}, 0x1234},
    {u16, dcba, {0x3412}, 0x1234},
    {i16, abcd, {0xFFFE}, -2},
    {i16, badc, {0xFEFF}, -2},
    {u48, abcd, {0x0102, 0x0304, 0x0506}, std::int64_t{0x010203040506}},
    {u48, cdab, {0x0506, 0x0304, 0x0102}, std::int64_t{0x010203040506}},
    {i48, abcd, {0xFFFF, 0xFFFF, 0xFFFE}, -2},
    {f16, abcd, {0x3C00}, 1.0},
    {f16, badc, {0x003C}, 1.0},
    {f16, abcd, {0xFBFF}, -65504.0},
    {f16, abcd, {0x0001}, 5.9604645e-8},  // the smallest
    {f16, abcd, {0x03FF}, 6.097555e-5},   // the largest below the normal ones
    {u32, abcd, {0x0102, 0x0304}, 0x01020304},
    {u32, cdab, {0x0304, 0x0102}, 0x01020304},
    {u32, badc, {0x0201, 0x0403}, 0x01020304},
    {u32, dcba, {0x0403, 0x0201}, 0x01020304},
    {i32, cdab, {0xFFFF, 0xFFFF}, -1},
    {u64, abcd, {0xFFFF, 0xFFFF, 0xFFFF, 0xFFFE}, std::uint64_t{0xFFFFFFFFFFFFFFFE}},
    {u64, dcba, {0x0807, 0x0605, 0x0403, 0x0201}, std::uint64_t{0x0102030405060708}},
    {i64, cdab, {0x0708, 0x0506, 0x0304, 0x0102}, std::int64_t{0x0102030405060708}},
    {f32, abcd, {0x41AC, 0x0000}, 21.5},
    {f32, abcd, {0x3DCC, 0xCCCD}, 0.1},
    {f32, abcd, {0x7F7F, 0xFFFF}, 3.4028235e38},  // the largest
    {f32, abcd, {0x4F00, 0x0000}, 2147483648.0},
    {f32, cdab, {0x0000, 0x41AC}, 21.5},
    {f32, badc, {0xAC41, 0x0000}, 21.5},
    {f32, dcba, {0x0000, 0xAC41}, 21.5},
    {f64, abcd, {0x4035, 0x8000, 0x0000, 0x0000}, 21.5},
    {f64, badc, {0x3540, 0x0080, 0x0000, 0x0000}, 21.5},
    {bcd16, abcd, {0x1234}, 1234},
    {bcd32, cdab, {0x5678, 0x1234}, 12345678},
    {string, abcd, {0x4142, 0x4344, 0x4500}, "ABCDE"s},
    {string, badc, {0x4241, 0x4443, 0x0045}, "ABCDE"s},
    {string, cdab, {0x4142, 0x4344, 0x4500}, "ABCDE"s},  // keeps its words
    {boolean, abcd, {0x0001}, true},
};

TEST(Value, OfEachTypeAndOrderIsDecodedAndEncoded) {
    for (const Vector& v : kVectors) {
        SCOPED_TRACE(::testing::Message() << label(v.type) << ' ' << label(v.order));
        const Point point = point_of(v.type, v.order);
        EXPECT_EQ(decode(point, v.words), v.value);
        EXPECT_EQ(encode(point, v.value).value(), v.words);
    }
}

struct Decoded {
    Point point;
    Words words;
    std::optional<Value> value;
};

void expect_decoded(const std::vector<Decoded>& rows) {
    for (const auto& [point, words, value] : rows)
        EXPECT_EQ(decode(point, words), value) << label(point.type) << ' ' << words[0];
}

TEST(Value, AByteIsHalfOfItsRegister) {
    expect_decoded({
        {point_of(u8h), {0xFE07}, 254},
        {point_of(u8l), {0xFE07}, 7},
        {point_of(i8h), {0xFE07}, -2},
        {point_of(i8l), {0x07FE}, -2},
        {point_of(u8h, badc), {0xFE07}, 7},
        {scaled(u8l, 0.1), {0xFF03}, 0.3},
        {without(u8h, {-1}), {0xFF07}, {}},
        {without(u8l, {0xFF}), {0x07FF}, {}},
    });
    EXPECT_EQ(encode(point_of(u8h), 7).value(), Words{0x0700});
    EXPECT_EQ(encode(point_of(i8l), -2).value(), Words{0x00FE});
    Point labelled = point_of(i8h);
    labelled.labels = {{-1, "none"}};
    EXPECT_EQ(label_of(labelled, Words{0xFF12}), "none");
}

TEST(Value, SentinelsBadDigitsAndNumbersThatAreNoneGiveNothing) {
    expect_decoded({
        // "No value" counts the bits of the type.
        {without(u16, {-1}), {0xFFFF}, {}},
        {without(u16, {-1}), {0xFFFE}, 0xFFFE},
        {without(i16, {65535, 32768}), {0xFFFF}, {}},
        {without(i16, {65535, 32768}), {0x8000}, {}},
        {without(i16, {-32768, 32767}), {0x8000}, {}},
        {without(i16, {-32768, 32767}), {0x7FFF}, {}},
        {without(i16, {-32768, 32767}), {0x7FFE}, 0x7FFE},
        {without(u64, {-1}), {0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF}, {}},
        {without(u64, {-1}), {0, 0, 0, 0xFFFF}, std::uint64_t{0xFFFF}},
        {without(bcd16, {9999}), {0x9999}, {}},
        // Of a float it is the number before the scale.
        {without(f32, {-9999}, 2), {0xC61C, 0x3C00}, {}},
        {without(f32, {-9999}, 2), {0xC61C, 0x4000}, -20000.0},
        {point_of(bcd16), {0x12A4}, {}},
        {point_of(f32), {0x7FC0, 0}, {}},  // not a number
        {point_of(f16), {0x7E00}, {}},
        {point_of(f16), {0xFC00}, {}},     // infinite
        {point_of(f32), {0x7F80, 0}, {}},  // infinite
        {point_of(u32), {1}, {}},          // too short
    });
}

TEST(Value, ABitOfAWordAndADecimalScale) {
    expect_decoded({
        {bit_of(3), {0x0008}, true},
        {bit_of(3), {0xFFF7}, false},
        // The double of the decimal number.
        {scaled(i16, 0.1), {3}, 0.3},  // not 0.30000000000000004
        {scaled(i16, 0.3), {3}, 0.9},
        {scaled(i16, 0.1, 0.2), {1}, 0.3},
        {scaled(i16, 0.1, -5), {0x0109}, 21.5},
        {scaled(i16, 1e-9, 1e3), {1}, 1000.000000001},
        {scaled(i16, -2.5, 10), {4}, 0.0},
        {scaled(i16, 1e15, 1e-15), {3}, 3e15},  // rounded as doubles are
    });
    const Point hundredths = scaled(i16, 0.01);
    const Point sevens = scaled(i16, 0.007);
    for (int raw = -32768; raw <= 32767; ++raw) {
        const Words words{static_cast<std::uint16_t>(raw)};
        ASSERT_EQ(decode(hundredths, words), Value(std::stod(std::to_string(raw) + "e-2")));
        ASSERT_EQ(decode(sevens, words), Value(std::stod(std::to_string(raw * 7) + "e-3")));
    }
}

TEST(Value, ATextEndsAtItsLengthItsFirstNulAndBeforeItsPadding) {
    expect_decoded({
        {text_of(5), {0x4142, 0x4344, 0x4546}, "ABCDE"s},
        {text_of(5), {0x4142, 0x0044, 0x4500}, "AB"s},
        {text_of(5), {0x4120, 0x2020, 0x2020}, "A"s},
        {text_of(4), {0x2041, 0x2042}, " A B"s},  // only those at its end
        {text_of(2), {0x2020}, ""s},
        {text_of(5), {0, 0, 0}, ""s},
    });
    EXPECT_EQ(encode(text_of(4), "ABC"s).value(), (Words{0x4142, 0x4300}));
    EXPECT_EQ(encode(text_of(6), "A"s).value(), (Words{0x4100, 0, 0}));
    EXPECT_EQ(encode(text_of(4), ""s).value(), (Words{0, 0}));
}

/// Of bytes as a panel would store them.
std::string shown(const std::string& bytes) {
    const Point point = text_of(static_cast<unsigned>(bytes.size()));
    return std::get<std::string>(*decode(point, encode(point, bytes).value()));
}

TEST(Value, ATextIsUtf8AndWhatIsNoneIsReplacedByteForByte) {
    expect_decoded({
        {text_of(5), {0xC3A9, 0xE282, 0xAC00}, "\xC3\xA9\xE2\x82\xAC"s},
        {text_of(5), {0xFF41, 0x4200, 0}, "\uFFFDAB"s},
        {text_of(5), {0xC080, 0x4100, 0}, "\uFFFD\uFFFDA"s},  // an overlong NUL
        {text_of(5), {0xE282, 0, 0}, "\uFFFD\uFFFD"s},        // cut off
        {text_of(2), {0x41C3}, "A\uFFFD"s},                   // by its length
    });
    for (const std::string good :
         {"\x7F", "\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80",
          "\xEF\xBF\xBF", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"})
        EXPECT_EQ(shown(good), good);
    for (const std::string bad : {"\x80", "\xFF", "\xE2\x82", "\xF0\x90\x80",  // begun or cut off
                                  "\xC1\xBF", "\xE0\x9F\xBF", "\xF0\x8F\xBF\xBF",  // overlong
                                  "\xED\xA0\x80",                                  // a surrogate
                                  "\xF4\x90\x80\x80", "\xF5\x80\x80\x80"}) {       // above U+10FFFF
        std::string unknown;
        for (std::size_t i = 0; i < bad.size(); ++i) unknown += "\uFFFD";
        EXPECT_EQ(shown(bad), unknown) << to_hex(Bytes(bad.begin(), bad.end()));
    }
    EXPECT_EQ(shown("A\xE2\x28\xA1Z"), "A\uFFFD(\uFFFDZ");
}

TEST(Value, LabelsNameRawValues) {
    Point point = point_of(u16);
    point.labels = {{0, "stopped"}, {1, "running"}};
    EXPECT_EQ(label_of(point, Words{1}), "running");
    EXPECT_FALSE(label_of(point, Words{2}));
    EXPECT_EQ(encode(point, "running"s).value(), Words{1});
}

/// Decodes random registers and encodes what they are.
void expect_round_trips(const Point& point, int times, std::mt19937_64& random) {
    for (int i = 0; i < times; ++i) {
        Words words(point.count());
        for (auto& word : words) word = static_cast<std::uint16_t>(random());
        const auto value = decode(point, words);
        if (!value) continue;  // invalid BCD, not a finite number
        const auto encoded = encode(point, *value);
        ASSERT_TRUE(encoded.has_value()) << label(point.type) << encoded.error().message;
        ASSERT_EQ(*encoded, words)
            << label(point.type) << ' ' << label(point.word_order) << " scale " << point.scale;
    }
}

TEST(Value, EveryTypeAndOrderRoundTrips) {
    std::mt19937_64 random(7);
    for (const WordOrder order : kOrders) {
        for (const Type type : kTypes)
            if (type != string && type != boolean && !is_byte(type))
                expect_round_trips(point_of(type, order), 2000, random);
        for (const Type type : {u16, i16, u32, i32, u48, i48, bcd16, bcd32}) {
            Point point = point_of(type, order);
            for (const double scale : {0.001, 0.1, 0.3, 1.0, 7.5, -0.25, -4.0}) {
                point.scale = scale;
                point.offset = static_cast<double>(random() % 2001) / 8 - 125;
                expect_round_trips(point, 200, random);
            }
        }
    }
    const Point point = scaled(i16, 0.1, -5);
    for (int raw = -32768; raw <= 32767; raw += 7) {
        const Words words{static_cast<std::uint16_t>(raw)};
        ASSERT_EQ(*encode(point, *decode(point, words)), words);
    }
}

TEST(Value, WhatIsShownHasARawNumberWhateverTheScale) {
    for (const double scale : {1.0 / 3, 0.123456789, 1e-12, 7.7e8, -0.1}) {
        for (const double offset : {0.0, 1.0 / 7, -1e6}) {
            const Point point = scaled(i16, scale, offset);
            const auto value = [&](int raw) {
                return decode(point, Words{static_cast<std::uint16_t>(raw)}).value();
            };
            for (int raw = -5000; raw <= 5000; raw += 37) {
                const Value here = value(raw);
                if (value(raw + 1) == here || value(raw - 1) == here)
                    continue;  // more digits than a double has
                ASSERT_EQ(encode(point, here).value(), Words{static_cast<std::uint16_t>(raw)})
                    << scale << ' ' << offset;
            }
        }
    }
}

TEST(Value, TextsRoundTripInEveryOrder) {
    std::mt19937_64 random(11);
    for (const WordOrder order : kOrders) {
        Point point = point_of(string, order);
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

TEST(Interpretations, ShowOneBlockInEveryWay) {
    const auto all = interpretations(Words{0x41AC, 0x0000});
    const auto find = [&](Type type, WordOrder order) {
        for (const Interpretation& one : all)
            if (one.type == type && one.order == order) return one.values;
        return std::vector<std::string>{"none"};
    };
    EXPECT_EQ(find(f32, abcd), std::vector<std::string>{"21.5"});
    EXPECT_EQ(find(u16, abcd), (std::vector<std::string>{"16812", "0"}));
    EXPECT_EQ(find(u32, cdab), std::vector<std::string>{"16812"});
    EXPECT_EQ(find(bcd16, abcd), (std::vector<std::string>{"", "0"}));
    EXPECT_EQ(find(u16, cdab), std::vector<std::string>{"none"});
    EXPECT_EQ(find(u8h, abcd), (std::vector<std::string>{"65", "0"}));
    EXPECT_EQ(find(u8h, badc), std::vector<std::string>{"none"});
    EXPECT_EQ(find(f64, abcd), std::vector<std::string>{"none"});
}

}  // namespace
}  // namespace panelgate::points::value_test
