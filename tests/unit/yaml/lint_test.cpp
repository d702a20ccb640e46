#include "lint.hpp"

#include <gmock/gmock.h>

#include <string>

namespace panelgate::yaml {
namespace {

using ::testing::IsEmpty;

std::string told(const Source& source, const Findings& findings) {
    std::string all;
    for (const Finding& finding : findings) {
        const Mark mark = source.mark(finding.offset);
        all += std::to_string(mark.line) + ':' + std::to_string(mark.column) + ' ';
    }
    return all;
}

std::string causes(std::string text) {
    const Source source(std::move(text));
    return told(source, find_causes(Scanned(source)));
}

std::string traps(std::string text) {
    const Source source(std::move(text));
    return told(source, find_traps(Scanned(source)));
}

/// What people write that is good YAML.
constexpr const char* kGood[] = {
    "a: 1\nb:\n- x\n- y\nc: [1, {d: 2}]\n",
    "a:\n  - b: 1\n    c:\n      - 1\n  - b: 2\n",
    "- - a: 1\n    b: 2\n  - c\n-\n  d: 3\n",
    "a: one text\n   on two lines\nb: \"more\n   lines\"\nc: 'x ''y'''\n",
    "a: |\n  any: thing\n   \"goes\n\n  [here\nb: >-\n  %\n",
    "a: [1,\n  2,\n]\nb: {c: d,\n    e: f}\n",
    "a: &x {b: 1}\nc: *x\nd: !!str e\n",
    "a: http://x:80/#y  # comment: [\n# {\nb: x:y\n",
    "%YAML 1.2\n---\na: 1\n...\n",
    "a: \"# {: \\\" x\" # \"\n\"b\": 'c'\n",
    "a: ${B:-c}\n",
    "a:\tb\nc: it's 5\" - x\n",
    "a:\n    b: 1\n\n# x\n    c: 2\nd: -5\n",
};

TEST(Lint, FindsNothingInGoodText) {
    for (const char* text : kGood) {
        EXPECT_THAT(causes(text), IsEmpty()) << text;
        EXPECT_THAT(traps(text), IsEmpty()) << text;
    }
}

TEST(Lint, AForgottenQuoteIsATrapWhereItOpens) {
    EXPECT_EQ(traps("a: \"b\nc: d\n"), "1:4 ");
    EXPECT_EQ(traps("a: \"b\nc: \"d\"\n"), "1:4 ");
    EXPECT_EQ(traps("- {a: 1, b: 'c}\n- {a: 2, b: 'd'}\n"), "1:13 ");
    EXPECT_EQ(traps("a:\n  b: 'c\n  d: e\nf: \"g\nh: i"), "2:6 4:4 ");
    EXPECT_EQ(traps("a: \"b\n\n  c\""), "");
}

TEST(Lint, AnOddBlankIsATrapOnlyWhereABlankHasAMeaning) {
    EXPECT_EQ(traps("\u00A0a: 1\n"), "1:1 ");
    EXPECT_EQ(traps("a:\u00A01\n"), "1:3 ");
    EXPECT_EQ(traps("a: 5\u00A0\u00B0C\nb: x:\u00A0y\n"), "");
}

TEST(Lint, OneCauseForEachLine) { EXPECT_EQ(causes("a:b\nc: %\n  \td: e\n"), "1:3 2:4 3:3 "); }

TEST(Lint, ABracketIsToldWhereItOpens) {
    EXPECT_EQ(causes("a: {b: 1\nc: [2\nd: 3\n"), "1:4 2:4 ");
    EXPECT_EQ(causes("a: [{b: 1]\n"), "1:5 ");
    EXPECT_EQ(causes("a: [b]]\n"), "1:7 ");
}

TEST(Lint, ShiftedLinesAreToldOnce) {
    EXPECT_EQ(causes("a:\n  - b: 1\n   c: 2\n   d: 3\n  - b: 2\n    c: 3\n"), "3:4 ");
    EXPECT_EQ(causes("a:\n  b: 1\n    c: 2\n    d: 3\n  e: 4\n"), "3:5 ");
}

TEST(Lint, LongLinesTakeNoLongerThanManyLines) {
    std::string quotes = "{";
    std::string brackets;
    for (int i = 0; i < 500'000; ++i) {
        quotes += "\"a\": 1, ";
        brackets += "{[}";
    }
    EXPECT_THAT(traps(quotes + "}\n"), IsEmpty());
    EXPECT_EQ(causes(brackets + "\n"), "1:2 ");
}

TEST(Lint, EndsOnAnyText) {
    for (const char* text :
         {"\"", "'",  "[",  "{",  "|",     ">",        "- ", "-",       ":",      "*",      "&",
          "!",  "%",  "\t", "${", "'\n'",  "\"\\",     "]",  "a:\n\t",  "- |",    "a: |",   "---",
          "\r", "{{", "[:", ",",  "- - -", "? a\n: b", "{a", "a: 'b'c", "\u00A0", "-\u00A0"}) {
        causes(text);
        traps(text);
    }
}

}  // namespace
}  // namespace panelgate::yaml
