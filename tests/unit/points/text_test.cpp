#include "registers.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

namespace panelgate::points::text_test {
namespace {

using Words = std::vector<std::uint16_t>;

const std::string kUnknown = "\xEF\xBF\xBD";  // U+FFFD

/// As a panel would store them.
Words words_of(const std::string& bytes) {
    return text_to_words(bytes, static_cast<unsigned>(bytes.size() + 1) / 2);
}
std::string shown(const std::string& bytes) {
    return text_of_words(words_of(bytes), static_cast<unsigned>(bytes.size()));
}

TEST(Text, TheHighByteOfAWordComesFirst) {
    EXPECT_EQ(text_of_words({0x4142, 0x4344}, 4), "ABCD");
    EXPECT_EQ(text_to_words("ABC", 2), (Words{0x4142, 0x4300}));
}

TEST(Text, WhatIsShorterIsFilledUpWithNul) {
    EXPECT_EQ(text_to_words("A", 3), (Words{0x4100, 0, 0}));
    EXPECT_EQ(text_to_words("", 2), (Words{0, 0}));
    EXPECT_EQ(text_of_words(text_to_words("A", 3), 6), "A");
}

TEST(Text, EndsAtItsLengthAtANulAndBeforeBlanksWhicheverComesFirst) {
    EXPECT_EQ(text_of_words({0x4142, 0x4344}, 3), "ABC");
    EXPECT_EQ(text_of_words({0x4142, 0x0044}, 4), "AB");
    EXPECT_EQ(text_of_words({0x4120, 0x2000}, 4), "A");
    EXPECT_EQ(text_of_words({0x2041, 0x2042}, 4), " A B") << "only those at its end";
    EXPECT_EQ(text_of_words({0x2020}, 2), "");
    EXPECT_EQ(text_of_words({}, 8), "");
}

TEST(Text, EveryLengthOfUtf8StaysAsItIs) {
    for (const std::string good :
         {"\x7F", "\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80",
          "\xEF\xBF\xBF", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"})
        EXPECT_EQ(shown(good), good);
}

TEST(Text, WhatIsNoUtf8IsReplacedByteForByte) {
    struct Case {
        std::string bytes;
        std::size_t unknown;
        const char* why;
    };
    for (const Case& c :
         {Case{"\x80", 1, "begins in the middle"}, Case{"\xC1\xBF", 2, "overlong"},
          Case{"\xE0\x9F\xBF", 3, "overlong"}, Case{"\xF0\x8F\xBF\xBF", 4, "overlong"},
          Case{"\xED\xA0\x80", 3, "a surrogate"}, Case{"\xF4\x90\x80\x80", 4, "above U+10FFFF"},
          Case{"\xF5\x80\x80\x80", 4, "above U+10FFFF"}, Case{"\xFF", 1, "nothing"},
          Case{"\xE2\x82", 2, "cut off"}, Case{"\xF0\x90\x80", 3, "cut off"}}) {
        std::string expected;
        for (std::size_t i = 0; i < c.unknown; ++i) expected += kUnknown;
        EXPECT_EQ(shown(c.bytes), expected) << c.why;
    }
}

TEST(Text, GoodTextAroundABadByteIsKept) {
    EXPECT_EQ(shown("A\xE2\x28\xA1Z"), "A" + kUnknown + "(" + kUnknown + "Z");
}

TEST(Text, ACharacterThatTheLengthCutsIsNotHalfShown) {
    EXPECT_EQ(text_of_words(words_of("A\xC3\xA9"), 2), "A" + kUnknown);
}

}  // namespace
}  // namespace panelgate::points::text_test
