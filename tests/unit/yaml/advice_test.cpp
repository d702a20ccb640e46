#include "advice.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "hints.hpp"
#include "source.hpp"

namespace panelgate::yaml::advice_test {
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
    return told(source, find_causes(source.text(), Lines(mask_variables(source.text())),
                                    source.text().size()));
}

std::string traps(std::string text) {
    const Source source(std::move(text));
    return told(source, find_traps(source.text(), Lines(mask_variables(source.text()))));
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
    "a: 3/4\"\nb: pipe 6'\nc: the operators' key\nx: it's\"\n\"d\" : \"e\n  f\" # g\n",
    "{\"a\":\"b, [c: {\",\"d\":[\"e\",'f: '],'g':1}\n",
    "a:\n    b: 1\n\n# x\n    c: 2\nd: -5\n",
};

TEST(Advice, FindsNothingInGoodText) {
    for (const char* text : kValid) {
        EXPECT_THAT(causes(text), IsEmpty()) << text;
        EXPECT_THAT(traps(text), IsEmpty()) << text;
    }
}

using Row = std::pair<const char*, const char*>;  ///< a text, and where something is found

/// What a parser accepts but users do not mean.
constexpr Row kTraps[] = {
    // a forgotten quote, where it opens
    {"a: \"b\nc: d\n", "1:4 "},
    {"a: \"b\nc: \"d\"\n", "1:4 "},
    {"- {a: 1, b: 'c}\n- {a: 2, b: 'd'}\n", "1:13 "},
    {"a:\n  b: 'c\n  d: e\nf: \"g\nh: i", "2:6 4:4 "},
    {"a: \"b\n\n  c\"", ""},
    // a dash of another program
    {"a:\n  \u2013 b: 1\n    c: 2\n  \u2014 b: 2\n", "2:3 4:3 "},
    {"a:\n  * b: 1\n    c: 2\n", "2:3 "},
    {"a: x \u2013 y\nb: \u2013\nc: [\u2013 d]\n", ""},
    // a quote of a word processor
    {"a: \u201Cb\u201D\n\u2018c\u2019: 1\n", "1:4 2:1 "},
    {"a: \u2019s b\nc: d \u201Ce\u201D\n", ""},
    // a wrong blank, only where a blank is significant
    {"\u00A0a: 1\n", "1:1 "},
    {"a:\u00A01\n", "1:3 "},
    {"a: 5\u00A0\u00B0C\nb: x:\u00A0y\n", ""},
};

/// Why a parser fails.
constexpr Row kCauses[] = {
    {"a:\n  \u2022 b: 1\n    c: 2\n", "2:3 "},
    // a misplaced dash: the line that does not agree with the others, the last if there is one
    {"a:\n   - b: 1\n    c: 2\n", "3:5 "},
    {"a:\n - b: 1\n    c: 2\n    d: 3\n", "2:2 "},
    {"a:\n  -  b: 1\n    c: 2\nd: 3\n", "3:5 "},
    {"a:\n  - b: 1\n   c: 2\n    d: 3\n", "3:4 "},  // the others agree with it
    {"a:\n  - b: 1\n   c: 2\n  - b: 2\n", "3:4 "},
    {"a:\n  - b: 1\n     c: 2\n  - b: 2\n", "3:6 "},
    // what other languages mean by it
    {"```yaml\na: 1\n```\n", "1:1 3:1 "},
    {"a:\n  -\tb: 1\n    c: 2\n", "2:4 "},
    {"{\n  // a\n  a: 1\n}\n", "2:3 "},
    // one for each line
    {"a:b\nc: %\n  \td: e\n", "1:3 2:4 3:3 "},
    // a bracket, where it opens
    {"a: {b: 1\nc: [2\nd: 3\n", "1:4 2:4 "},
    {"a: [{b: 1]\n", "1:5 "},
    {"a: [b]]\n", "1:7 "},
    // shifted lines, once
    {"a:\n  - b: 1\n   c: 2\n   d: 3\n  - b: 2\n    c: 3\n", "3:4 "},
    {"a:\n  b: 1\n    c: 2\n    d: 3\n  e: 4\n", "3:5 "},
};

TEST(Advice, MistakesAreReportedAtTheirPlace) {
    for (const auto& [text, places] : kTraps) EXPECT_EQ(traps(text), places) << text;
    for (const auto& [text, places] : kCauses) EXPECT_EQ(causes(text), places) << text;
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
  - "b": "cd"
    "e": "/f"
    "g": {"h": 1, "i": "j"}
    "k":
      - {"l": 31, "b": "m"}
"n":
  - "o": "p:502"
)"};

TEST(Advice, AMissingQuoteIsReportedFirstOnItsLine) {
    for (const char mark : {'"', '\''}) {
        for (std::string all : kQuoted) {
            std::ranges::replace(all, '"', mark);
            EXPECT_THAT(causes(all), IsEmpty()) << all;
            for (std::size_t at = all.find(mark); at != all.npos; at = all.find(mark, at + 1)) {
                const auto line =
                    1 + std::count(all.begin(), all.begin() + static_cast<long>(at), '\n');
                const std::string text = all.substr(0, at) + all.substr(at + 1);
                EXPECT_THAT(causes(text), StartsWith(std::to_string(line) + ':')) << text;
            }
        }
    }
}

TEST(Advice, LongLinesTakeNoLongerThanManyLines) {
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

TEST(Advice, EndsOnAnyText) {
    for (const char* text :
         {"\"", "'",  "[",  "{",  "|",     ">",        "- ", "-",       ":",      "*",      "&",
          "!",  "%",  "\t", "${", "'\n'",  "\"\\",     "]",  "a:\n\t",  "- |",    "a: |",   "---",
          "\r", "{{", "[:", ",",  "- - -", "? a\n: b", "{a", "a: 'b'c", "\u00A0", "-\u00A0"}) {
        causes(text);
        traps(text);
    }
}

using HintOf = std::string (*)(std::string_view text);

/// Each row: what is typed, and what the hint says to write.
void expect_hints(HintOf hint, std::initializer_list<std::string_view> rows) {
    for (const std::string_view row : rows) {
        const std::size_t arrow = row.find(" -> ");
        EXPECT_EQ(hint(row.substr(0, arrow)), "; write " + std::string(row.substr(arrow + 4)));
    }
}

void expect_none(HintOf hint, std::initializer_list<std::string_view> texts) {
    for (const std::string_view text : texts) EXPECT_EQ(hint(text), "") << text;
}

TEST(Hints, WriteADurationAsItIsRead) {
    expect_hints(duration_hint, {"0.5s -> 500ms", "1,5 s -> 1500ms", "500 ms -> 500ms",
                                 "500MS -> 500ms", "2 minutes -> 2min", "1h -> 60min"});
    EXPECT_EQ(duration_hint("500"), " (add a unit: us, ms, s, min)");
    EXPECT_EQ(duration_hint("1m"), "; write ms or min");
    expect_none(duration_hint, {"", "soon", "5 parsecs", "-5ms", "1e9s", "5ms5"});
}

TEST(Hints, WriteANumberAsItIsRead) {
    const HintOf fraction = [](std::string_view text) { return number_hint(text, false); };
    const HintOf whole = [](std::string_view text) { return number_hint(text, true); };
    expect_hints(fraction, {"0,1 -> 0.1", "400 C -> 400", "10% -> 0.1", "9.6k -> 9600"});
    expect_none(fraction, {"", "ten", "-", ".", "/", "1/0", "x", "^2"});
    expect_hints(whole, {"0x1F -> 31", "1.0 -> 1", "9600 baud -> 9600", "40k -> 40000"});
    expect_none(whole, {"1.5", "1.5.600", "k", "ten", "1/0", "9600/8", "x"});
}

TEST(Hints, WriteABlankAsItIsRead) {
    EXPECT_EQ(blank_hint("baud:9600"), "; a blank is missing after 'baud:'");
    EXPECT_EQ(blank_hint("baud=9600"), "; write baud: 9600");
    EXPECT_EQ(blank_hint("tcp://x:1"), "");
    EXPECT_EQ(blank_hint("two words:1"), "");
}

}  // namespace
}  // namespace panelgate::yaml::advice_test
