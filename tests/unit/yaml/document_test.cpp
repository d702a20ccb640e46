#include "panelgate/yaml/document.hpp"

#include <gmock/gmock.h>

#include <stdexcept>
#include <string>
#include <string_view>

#include "encoding.hpp"

namespace panelgate::yaml::document_test {
namespace {

using namespace std::string_view_literals;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Parsed {
    Node root;
    std::string problems;
};

Parsed read(std::string_view text) {
    Problems problems("f.yaml");
    Parsed parsed;
    parsed.root = parse(text, problems);
    parsed.problems = problems.text();
    return parsed;
}

const Node& value(const Node& map, std::string_view key) {
    for (const Entry& entry : map.entries) {
        if (entry.key == key) return entry.value;
    }
    throw std::out_of_range(std::string(key));
}

std::string place(Mark mark) {
    return std::to_string(mark.line) + ':' + std::to_string(mark.column);
}

std::string repeat(std::string_view text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
}

TEST(Document, CountsLinesAndColumnsFromOne) {
    const Node root = read("a: 1\nb:\n  - x\n  - {c: 2}\n").root;
    EXPECT_EQ(place(root.mark), "1:1");
    EXPECT_EQ(place(root.entries[1].mark), "2:1");
    EXPECT_EQ(place(value(root, "a").mark), "1:4");
    const Node& list = value(root, "b");
    EXPECT_EQ(place(list.items[0].mark), "3:5");
    EXPECT_EQ(place(list.items[1].entries[0].mark), "4:6");
    EXPECT_EQ(place(value(list.items[1], "c").mark), "4:9");
}

TEST(Document, LeavesScalarsAndTheirOrderAsTheyWereWritten) {
    const Node root = read("z: 010\nb: yes\nc: 0x1F\nd: 1.50\ne: 040001\na: off\n").root;
    std::string all;
    for (const Entry& entry : root.entries) all += entry.key + '=' + entry.value.scalar + ' ';
    EXPECT_EQ(all, "z=010 b=yes c=0x1F d=1.50 e=040001 a=off ");
}

TEST(Document, DistinguishesQuotedFromPlain) {
    const Node root = read("a: 1\nb: '1'\nc: \"1\"\nd: |\n  1\ne: ''\n").root;
    EXPECT_FALSE(value(root, "a").quoted);
    for (const char* key : {"b", "c", "d", "e"}) EXPECT_TRUE(value(root, key).quoted) << key;
    EXPECT_EQ(value(root, "e").kind, Node::Kind::scalar);
    EXPECT_EQ(value(root, "e").scalar, "");
}

TEST(Document, MarksAnEmptyValueAtItsKey) {
    const Node root = read("\n  a:\n\n  b: ~\n  c: null\n").root;
    for (const char* key : {"a", "b", "c"}) EXPECT_EQ(value(root, key).kind, Node::Kind::null);
    EXPECT_EQ(place(value(root, "a").mark), "2:3");
    EXPECT_EQ(place(value(root, "b").mark), "4:3");
}

TEST(Document, ReportsADuplicateKeyAndKeepsTheFirst) {
    const Parsed parsed = read("a: 1\nb: {c: 1, c: 2}\na: 3\n");
    EXPECT_EQ(parsed.problems,
              "f.yaml:2:11: duplicate key 'c', already on line 2\n"
              "f.yaml:3:1: duplicate key 'a', already on line 1\n");
    EXPECT_EQ(value(parsed.root, "a").scalar, "1");
    EXPECT_EQ(parsed.root.entries.size(), 2U);
}

struct Row {
    std::string_view text;
    const char* problems;
};

constexpr Row kRefused[] = {
    {"? [a]\n: b\n", "f.yaml:1:3: a key must be a word\n"},
    {"~: x\nb: 1\n", "f.yaml:1:1: a key must be a word\n"},
    {"{a: 1}: b\n", "f.yaml:1:1: a key must be a word, not a map; a variable is written ${NAME}\n"},
    {"a: !foo x\n",
     "f.yaml:1:4: a tag ('!foo') has no meaning here; leave it out, or put the text in quotes\n"},
    {"a: 1\n---\nb: 2\n", "f.yaml:2:1: a second document; the file must hold one only\n"},
    {"a: 1\n---\n", "f.yaml:2:1: a second document; the file must hold one only\n"},
    {"a: &x [1, *x]\n", "f.yaml:1:11: an alias must not be inside what it repeats\n"},
    {"- id: 1\n  name: a\n  id: 2\n  name: b\n",
     "f.yaml:3:3: duplicate key 'id', already on line 1; is a '- ' missing before it?\n"},
    // a syntax error is one problem, at its cause
    {"a: b: c\n",
     "f.yaml:1:4: two keys on one line; begin a new line for 'b'; "
     "one text that holds ': ' must be in quotes: \"b: c\"\n"
     "  a: b: c\n"
     "     ^\n"},
    {"lines: [\nb: 1\n",
     "f.yaml:1:8: '[' is never closed; a ']' is missing after it\n"
     "  lines: [\n"
     "         ^\n"},
    {"a:\tb\n\tc: d\n",
     "f.yaml:2:1: a tab in the indentation; type blanks in its place\n"
     "  \tc: d\n"
     "  ^\n"},
    // an error of the parser that no lint explains
    {"a: |0\n  b\n",
     "f.yaml:1:6: 0 cannot follow | or >; leave it out\n"
     "  a: |0\n"
     "       ^\n"},
    // a forgotten quote takes nothing along
    {"a:\n  unit: \"celsius\n  b: 1\nc: 2\n",
     "f.yaml:2:9: the quote \" opened here is not closed; write \"celsius\"\n"
     "    unit: \"celsius\n"
     "          ^\n"},
    // bytes that are no UTF-8, each line's first at its place
    {"a: 1\nunit: \xB0 C\n",
     "f.yaml:2:7: byte 0xB0 is not UTF-8; save the file as UTF-8\n"
     "  unit: \uFFFD C\n"
     "        ^\n"},
    {"# \xB0\xB0\na: 1 # \xC3\n",
     "f.yaml:1:3: byte 0xB0 is not UTF-8; save the file as UTF-8\n"
     "  # \uFFFD\uFFFD\n"
     "    ^\n"
     "f.yaml:2:8: byte 0xC3 is not UTF-8; save the file as UTF-8\n"
     "  a: 1 # \uFFFD\n"
     "         ^\n"},
    // a control character does not end the file
    {"a: 1\n\x04\nb: 2\n",
     "f.yaml:2:1: control character U+0004 in the text; remove it\n"
     "  \uFFFD\n"
     "  ^\n"},
    // the caret stands below wide characters
    {"\uD55C\uAD6D: %\n",
     "f.yaml:1:5: a text that begins with '%' must be in quotes; write \"%\"\n"
     "  \uD55C\uAD6D: %\n"
     "        ^\n"},
};

TEST(Document, RefusesWithThePlaceAndTheCorrection) {
    for (const auto& [text, problems] : kRefused) EXPECT_EQ(read(text).problems, problems) << text;
    for (const char* tagged : {"a: !!int 3\n", "a: !!map {b: 1}\n"})
        EXPECT_THAT(read(tagged).problems, HasSubstr("f.yaml:1:4: a tag ("));
    for (const char* broken : {"a: b: c\n", "a:\n  unit: \"celsius\n  b: 1\nc: 2\n"})
        EXPECT_EQ(read(broken).root.kind, Node::Kind::null);
    EXPECT_EQ(read("~: x\nb: 1\n").root.entries.size(), 1U);
}

TEST(Document, TakesWhatIsOneDocument) {
    for (const char* text : {"---\na: 1\n", "---\na: 1\n...\n", "%YAML 1.2\n---\na: 1\n",
                             "a: \"one\n  text\"\nb: 1\n"})
        EXPECT_THAT(read(text).problems, IsEmpty()) << text;
    for (const char* empty : {"", "\n", "# only a comment\n", "---\n"}) {
        const Parsed parsed = read(empty);
        EXPECT_THAT(parsed.problems, IsEmpty()) << empty;
        EXPECT_EQ(parsed.root.kind, Node::Kind::null) << empty;
    }
}

TEST(Document, ADecimalCommaInsideBracketsIsKeptForTheReader) {
    const Parsed parsed = read("{scale: 0,1, every: 1,5s, b: 2}\n");
    EXPECT_THAT(parsed.problems, IsEmpty());
    EXPECT_EQ(value(parsed.root, "scale").scalar, "0,1");
    EXPECT_TRUE(value(parsed.root, "scale").comma);
    EXPECT_EQ(value(parsed.root, "every").scalar, "1,5s");
    EXPECT_EQ(parsed.root.entries.size(), 3U);
    EXPECT_FALSE(value(parsed.root, "b").comma);
}

TEST(Document, LongTextsInMessagesAreCut) {
    const std::string key = repeat("x", 10'000);
    EXPECT_LT(read(key + ": 1\n" + key + ": 2\n").problems.size(), 300U);
    EXPECT_LT(read("a: %" + key + "\n").problems.size(), 400U);
    EXPECT_LT(read(key + ": *" + key + "\n").problems.size(), 500U);
}

TEST(Document, AnAliasRepeatsItsAnchorAtItsOwnPlace) {
    const Parsed parsed = read("a: &x {b: 1}\nc: *x\n");
    EXPECT_THAT(parsed.problems, IsEmpty());
    EXPECT_EQ(value(value(parsed.root, "c"), "b").scalar, "1");
    EXPECT_EQ(place(value(parsed.root, "c").mark), "2:4");
}

TEST(Document, StopsAtNestingBombs) {
    for (const char* opening : {"[", "{a: ", "- ", "[{a: "}) {
        const Parsed parsed = read(repeat(opening, 100'000));
        EXPECT_THAT(parsed.problems, HasSubstr("nested deeper than 64 levels")) << opening;
        EXPECT_EQ(parsed.root.kind, Node::Kind::null) << opening;
    }
    EXPECT_THAT(read(repeat("[", 64) + repeat("]", 64)).problems, IsEmpty());
    for (const std::string& text : {repeat("[", 65) + repeat("]", 65), repeat("[", 4'000'000)})
        EXPECT_EQ(read(text).problems, "f.yaml:1:65: nested deeper than 64 levels\n");
    const std::string deep = repeat("[", 40) + repeat("]", 40);  // behind an alias
    EXPECT_EQ(read("a: &x " + deep + "\nb: " + repeat("[", 30) + "*x" + repeat("]", 30)).problems,
              "f.yaml:2:34: nested deeper than 64 levels\n");
}

TEST(Document, StopsAtAliasesThatGrowWithoutEnd) {
    std::string text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
    for (int i = 1; i < 12; ++i) {
        const std::string before = "*a" + std::to_string(i - 1);
        const std::string name = "a" + std::to_string(i);
        text += name + ": &" + name + " [" + before + repeat(", " + before, 9) + "]\n";
    }
    EXPECT_THAT(read(text).problems, HasSubstr("more than 500000 values"));
    EXPECT_THAT(read(repeat("- x\n", 500'001)).problems, HasSubstr("more than 500000 values"));
}

TEST(Document, StopsAtAliasesThatRepeatLongTexts) {
    std::string text = "a: &a " + repeat("x", 1'000'000) + "\nb: [*a" + repeat(", *a", 2'999);
    EXPECT_EQ(read(text + "]\n").problems,
              "f.yaml:2:13: more than 4 MiB of text, repetitions by aliases (*) included; "
              "repeat less\n");
    text = "a: &a {";
    for (const char* key : {"k", "l", "m"}) text += repeat(key, 1'000) + ": 1, ";
    text += "}\nb: [*a" + repeat(", *a", 1'500) + "]\n";
    EXPECT_THAT(read(text).problems, HasSubstr("more than 4 MiB of text"));
}

TEST(Document, CountsWhatNestedAnchorsKeep) {
    std::string text;
    for (int i = 0; i < 60; ++i) text += "&a" + std::to_string(i) + " [";
    const std::string closing = repeat("]", 60);
    EXPECT_THAT(read(text + "x" + closing).problems, IsEmpty());
    EXPECT_THAT(read(text + repeat("x, ", 15'000) + closing).problems,
                HasSubstr("more than 500000 values"));
    EXPECT_THAT(read(text + repeat("x", 1'000'000) + closing).problems,
                HasSubstr("more than 4 MiB of text"));
}

TEST(Document, SkipsAByteOrderMarkAndReadsWindowsLineEnds) {
    const Parsed parsed = read("\uFEFFa: 1\r\nb: 2\r\n");
    EXPECT_THAT(parsed.problems, IsEmpty());
    EXPECT_EQ(value(parsed.root, "a").scalar, "1");
    EXPECT_EQ(value(parsed.root, "b").scalar, "2");
    EXPECT_EQ(place(value(parsed.root, "b").mark), "2:4");
}

TEST(Document, ColumnsCountCharacters) {
    const Node root = read("{\uD55C\uAD6D: \u00B0C, a: {b: 1}}\n").root;
    ASSERT_EQ(root.entries.size(), 2U);
    EXPECT_EQ(root.entries[0].key, "\uD55C\uAD6D");
    EXPECT_EQ(root.entries[0].value.mark.column, 6);
    EXPECT_EQ(root.entries[1].mark.column, 10);
}

struct Encoded {
    std::string_view bytes;
    std::string_view text;
};

constexpr Encoded kEncoded[] = {
    {"", ""},
    {"a: 1\n", "a: 1\n"},
    {"unit: \u00B0C \uD55C\uAD6D \U0001F600\n", "unit: \u00B0C \uD55C\uAD6D \U0001F600\n"},
    {"a:\t1\r\n\u0085", "a:\t1\r\n\u0085"},
    {"\uFEFFa: 1", "a: 1"},
    // Of two and four bytes a character, by their first bytes
    {"\xFF\xFE\x61\0:\0 \0\xB0\0"sv, "a: \u00B0"},
    {"\xFE\xFF\0a\xD8\x3D\xDE\0"sv, "a\U0001F600"},
    {"a\0:\0"sv, "a:"},
    {"\0a\0:"sv, "a:"},
    {"\0\0\xFE\xFF\0\0\0a"sv, "a"},
    {"\xFF\xFE\0\0\x61\0\0\0"sv, "a"},
    // a CR alone ends a line
    {"a: 1\rb: 2\r", "a: 1\nb: 2\n"},
    {"a: 1\r\nb: 2\r\r\n", "a: 1\r\nb: 2\n\r\n"},
};

TEST(Encoding, ReadsAnyUnicode) {
    for (const auto& [bytes, text] : kEncoded) {
        const Decoded decoded = decode(bytes);
        EXPECT_EQ(decoded.text, text);
        EXPECT_THAT(decoded.bad, IsEmpty()) << text;
    }
}

TEST(Encoding, RefusesWhatOnlyLooksLikeUnicode) {
    for (const std::string_view bytes : {"\xC0\xAF"sv, "\xE0\x80\x80"sv, "\xED\xA0\x80"sv,
                                         "\xF4\x90\x80\x80"sv, "\xF5"sv, "\xE2\x82"sv})
        EXPECT_FALSE(decode(std::string("a: 1 # ") += bytes).bad.empty());
    for (const std::string_view bytes : {"\xFF\xFE\x61\0\0\xDC"sv, "\xFF\xFE\x61"sv})
        EXPECT_FALSE(decode(bytes).bad.empty());
    EXPECT_EQ(decode("a\0"sv).bad.size(), 0U);  // two bytes a character
    EXPECT_EQ(decode("aaa\0"sv).bad.size(), 1U);
    EXPECT_EQ(decode("a\n" + repeat("\xFF\xFF\n", 1000)).bad.size(), 50U) << "a few lines only";
}

TEST(Problems, AfterFiftyIsACount) {
    Problems problems("f");
    for (int i = 1; i <= 51; ++i) problems.add({i, 1}, "x");
    EXPECT_THAT(problems.text(), EndsWith("f:51:1: x\n"));
    problems.add({52, 1}, "x");
    EXPECT_THAT(problems.text(),
                EndsWith("f:50:1: x\nf:51:1: 2 more faults from here on; mend those above and "
                         "check again\n"));
}

TEST(Problems, AreSortedByPlaceWithOtherFilesLast) {
    Problems other("a.yaml");
    other.add({1, 1}, "elsewhere");
    Problems problems("z.yaml");
    problems.take(other);
    problems.add({9, 1}, "last");
    problems.add({2, 7}, "second");
    problems.add({2, 3}, "first");
    problems.add({2, 3}, "at the same place, as found");
    EXPECT_EQ(problems.text(),
              "z.yaml:2:3: first\n"
              "z.yaml:2:3: at the same place, as found\n"
              "z.yaml:2:7: second\n"
              "z.yaml:9:1: last\n"
              "a.yaml:1:1: elsewhere\n");
}

}  // namespace
}  // namespace panelgate::yaml::document_test
