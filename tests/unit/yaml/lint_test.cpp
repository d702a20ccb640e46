#include "lint.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>

namespace panelgate::yaml::lint_test {
namespace {

using ::testing::IsEmpty;
using ::testing::StartsWith;

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

/// Valid YAML as users write it.
constexpr const char* kValid[] = {
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
    "a: 3/4\"\nb: pipe 6'\nc: the operators' key\n\"d\" : \"e\n  f\" # g\n",
    "{\"a\":\"b, [c: {\",\"d\":[\"e\",'f: '],'g':1}\n",
    "a:\n    b: 1\n\n# x\n    c: 2\nd: -5\n",
};

TEST(Lint, FindsNothingInGoodText) {
    for (const char* text : kValid) {
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

/// Other programs write every key and text in quotes.
constexpr const char* kQuoted[] = {
    R"({
  "a": [
    {
      "b": "c1",
      "d": "/dev/tty0",
      "e": {"f": 9600, "g": "none"},
      "h": [
        {"i": 31, "b": "x, y", "j": "k"}
      ]
    }
  ],
  "l": [
    {"m": "[::1]:502"}
  ]
}
)",
    R"({"a":[{"b":"c","d":"/e"},
{"b":"f"}],
"g":[{"m":"h"}]}
)",
    R"("a":
  - "b": "c d"
    "e": "/f"
    "g": {"h": 1, "i": "j"}
    "k":
      - {"l": 31, "b": "m"}
"n":
  - "o": "p:502"
)"};

TEST(Lint, AMissingQuoteIsReportedFirstOnItsLine) {
    for (const char mark : {'"', '\''}) {
        for (std::string all : kQuoted) {
            std::ranges::replace(all, '"', mark);
            EXPECT_THAT(causes(all), IsEmpty()) << all;
            for (std::size_t at = all.find(mark); at != all.npos; at = all.find(mark, at + 1)) {
                const auto line =
                    1 + std::count(all.begin(), all.begin() + static_cast<long>(at), '\n');
                const std::string text = all.substr(0, at) + all.substr(at + 1);
                EXPECT_THAT(traps(text), StartsWith(std::to_string(line) + ':')) << text;
                EXPECT_THAT(causes(text), StartsWith(std::to_string(line) + ':')) << text;
            }
        }
    }
}

TEST(Lint, ADashOfAnotherProgramIsATrap) {
    EXPECT_EQ(traps("a:\n  \u2013 b: 1\n    c: 2\n  \u2014 b: 2\n"), "2:3 4:3 ");
    EXPECT_EQ(traps("a:\n  * b: 1\n    c: 2\n"), "2:3 ");
    EXPECT_EQ(causes("a:\n  \u2022 b: 1\n    c: 2\n"), "2:3 ");
    EXPECT_EQ(traps("a: x \u2013 y\nb: \u2013\nc: [\u2013 d]\n"), "");
}

TEST(Lint, AQuoteOfAWordProcessorIsATrap) {
    EXPECT_EQ(traps("a: \u201Cb\u201D\n\u2018c\u2019: 1\n"), "1:4 2:1 ");
    EXPECT_EQ(traps("a: \u2019s b\nc: d \u201Ce\u201D\n"), "");
}

TEST(Lint, AMisplacedDashIsReportedAtItsPlace) {
    EXPECT_EQ(causes("a:\n   - b: 1\n    c: 2\n"), "2:4 ");
    EXPECT_EQ(causes("a:\n - b: 1\n    c: 2\n    d: 3\n"), "2:2 ");
    EXPECT_EQ(causes("a:\n  -  b: 1\n    c: 2\nd: 3\n"), "2:3 ");
    EXPECT_EQ(causes("a:\n  - b: 1\n   c: 2\n    d: 3\n"), "3:4 ") << "the others agree with it";
    EXPECT_EQ(causes("a:\n  - b: 1\n   c: 2\n  - b: 2\n"), "3:4 ");
    EXPECT_EQ(causes("a:\n  - b: 1\n     c: 2\n  - b: 2\n"), "3:6 ");
}

TEST(Lint, TextCopiedFromAroundAFileIsReportedAtItsPlace) {
    EXPECT_EQ(causes("```yaml\na: 1\n```\n"), "1:1 3:1 ");
    EXPECT_EQ(causes("$ cat a.yaml\na:\n  - b\n"), "1:1 ");
    EXPECT_EQ(causes("a:\n&nbsp;&nbsp;b: 1\n"), "2:1 ");
    EXPECT_EQ(causes("a:\n  -\tb: 1\n    c: 2\n"), "2:4 ");
    EXPECT_EQ(causes("{\n  // a\n  a: 1\n}\n"), "2:3 ");
}

TEST(Lint, AWrongBlankIsATrapOnlyWhereABlankIsSignificant) {
    EXPECT_EQ(traps("\u00A0a: 1\n"), "1:1 ");
    EXPECT_EQ(traps("a:\u00A01\n"), "1:3 ");
    EXPECT_EQ(traps("a: 5\u00A0\u00B0C\nb: x:\u00A0y\n"), "");
}

TEST(Lint, OneCauseForEachLine) { EXPECT_EQ(causes("a:b\nc: %\n  \td: e\n"), "1:3 2:4 3:3 "); }

TEST(Lint, ABracketIsReportedWhereItOpens) {
    EXPECT_EQ(causes("a: {b: 1\nc: [2\nd: 3\n"), "1:4 2:4 ");
    EXPECT_EQ(causes("a: [{b: 1]\n"), "1:5 ");
    EXPECT_EQ(causes("a: [b]]\n"), "1:7 ");
}

TEST(Lint, ShiftedLinesAreReportedOnce) {
    EXPECT_EQ(causes("a:\n  - b: 1\n   c: 2\n   d: 3\n  - b: 2\n    c: 3\n"), "3:4 ");
    EXPECT_EQ(causes("a:\n  b: 1\n    c: 2\n    d: 3\n  e: 4\n"), "3:5 ");
}

TEST(Lint, LongLinesTakeNoLongerThanManyLines) {
    std::string quotes = "{";
    std::string unclosed = "{";
    std::string brackets;
    for (int i = 0; i < 500'000; ++i) {
        unclosed += "\"a: \"b\",";
        quotes += "\"a\": 1, ";
        brackets += "{[}";
    }
    EXPECT_THAT(traps(quotes + "}\n"), IsEmpty());
    EXPECT_EQ(traps(unclosed + "}\n"), "1:2 ");
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
}  // namespace panelgate::yaml::lint_test
