#include "encoding.hpp"

#include <gmock/gmock.h>

#include <string>
#include <string_view>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml::encoding_test {
namespace {

using namespace std::string_view_literals;
using ::testing::IsEmpty;

std::string problems_of(std::string_view bytes) {
    Problems problems("f.yaml");
    parse(bytes, problems);
    return problems.text();
}

TEST(Encoding, ReadsUtf8AsItIs) {
    for (const std::string_view text :
         {""sv, "a: 1\n"sv, "unit: \u00B0C \uD55C\uAD6D \U0001F600\n"sv}) {
        EXPECT_EQ(decode(text).text, text);
        EXPECT_THAT(decode(text).bad, IsEmpty());
    }
    EXPECT_EQ(decode("\xEF\xBB\xBF"
                     "a: 1")
                  .text,
              "a: 1");
}

TEST(Encoding, ReadsUtf16AndUtf32ByTheirFirstBytes) {
    EXPECT_EQ(decode("\xFF\xFE"
                     "a\0:\0 \0\xB0\0"sv)
                  .text,
              "a: \u00B0");
    EXPECT_EQ(decode("\xFE\xFF\0a\xD8\x3D\xDE\0"sv).text, "a\U0001F600");
    EXPECT_EQ(decode("a\0:\0"sv).text, "a:");
    EXPECT_EQ(decode("\0a\0:"sv).text, "a:");
    EXPECT_EQ(decode("\0\0\xFE\xFF\0\0\0a"sv).text, "a");
    EXPECT_EQ(decode("\xFF\xFE\0\0a\0\0\0"sv).text, "a");
}

TEST(Encoding, AByteThatIsNoUtf8IsAProblemAtItsPlace) {
    EXPECT_EQ(problems_of("a: 1\nunit: \xB0"
                          "C\n"),
              "f.yaml:2:7: byte 0xB0 is not UTF-8; save the file as UTF-8\n"
              "  unit: \uFFFDC\n"
              "        ^\n");
    EXPECT_EQ(problems_of("# \xB0\xB0\na: 1 # \xC3\n"),
              "f.yaml:1:3: byte 0xB0 is not UTF-8; save the file as UTF-8\n"
              "  # \uFFFD\uFFFD\n"
              "    ^\n"
              "f.yaml:2:8: byte 0xC3 is not UTF-8; save the file as UTF-8\n"
              "  a: 1 # \uFFFD\n"
              "         ^\n");
}

TEST(Encoding, RefusesWhatOnlyLooksLikeUtf8) {
    for (const std::string_view bytes : {"\xC0\xAF"sv, "\xE0\x80\x80"sv, "\xED\xA0\x80"sv,
                                         "\xF4\x90\x80\x80"sv, "\xF5"sv, "\xE2\x82"sv}) {
        EXPECT_FALSE(decode(std::string("a: 1 # ") += bytes).bad.empty());
    }
    EXPECT_FALSE(decode("\xFF\xFE"
                        "a\0\0\xDC"sv)
                     .bad.empty());
    EXPECT_FALSE(decode("\xFF\xFE"
                        "a"sv)
                     .bad.empty());
}

TEST(Encoding, AControlCharacterDoesNotEndTheFile) {
    EXPECT_EQ(problems_of("a: 1\n\x04\nb: 2\n"),
              "f.yaml:2:1: control character U+0004 in the text; remove it\n"
              "  \uFFFD\n"
              "  ^\n");
    EXPECT_EQ(decode("a\0"sv).bad.size(), 0U);  // two bytes a character
    EXPECT_EQ(decode("aaa\0"sv).bad.size(), 1U);
    EXPECT_THAT(decode("a:\t1\r\n\u0085").bad, IsEmpty());
}

TEST(Encoding, ReportsAFewLinesOnly) {
    std::string text;
    for (int i = 0; i < 1000; ++i) text += "\xFF\xFF\n";
    EXPECT_EQ(decode("a\n" + text).bad.size(), 50U);
}

TEST(Encoding, ColumnsCountCharacters) {
    Problems problems("f");
    const Node root = parse("{\uD55C\uAD6D: \u00B0C, a: {b: 1}}\n", problems);
    ASSERT_EQ(root.entries.size(), 2U);
    EXPECT_EQ(root.entries[0].key, "\uD55C\uAD6D");
    EXPECT_EQ(root.entries[0].value.mark.column, 6);
    EXPECT_EQ(root.entries[1].mark.column, 10);
}

TEST(Encoding, TheCaretStandsBelowWideCharacters) {
    EXPECT_EQ(problems_of("\uD55C\uAD6D: %\n"),
              "f.yaml:1:5: a text that begins with '%' must be in quotes; write \"%\"\n" +
                  std::string("  \uD55C\uAD6D: %\n") + "        ^\n");
}

TEST(Encoding, ACrAloneEndsALine) {
    EXPECT_EQ(decode("a: 1\rb: 2\r").text, "a: 1\nb: 2\n");
    EXPECT_EQ(decode("a: 1\r\nb: 2\r\r\n").text, "a: 1\r\nb: 2\n\r\n");
}

}  // namespace
}  // namespace panelgate::yaml::encoding_test
