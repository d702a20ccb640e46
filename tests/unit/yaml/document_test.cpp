#include "panelgate/yaml/document.hpp"

#include <gmock/gmock.h>

#include <string>

namespace panelgate::yaml::document_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StrEq;

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

TEST(Document, LeavesScalarsAsTheyWereWritten) {
    const Node root = read("a: 010\nb: yes\nc: 0x1F\nd: 1.50\ne: 040001\nf: off\n").root;
    EXPECT_EQ(value(root, "a").scalar, "010");
    EXPECT_EQ(value(root, "b").scalar, "yes");
    EXPECT_EQ(value(root, "c").scalar, "0x1F");
    EXPECT_EQ(value(root, "d").scalar, "1.50");
    EXPECT_EQ(value(root, "e").scalar, "040001");
    EXPECT_EQ(value(root, "f").scalar, "off");
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

TEST(Document, KeepsTheOrderOfTheFile) {
    std::string keys;
    for (const Entry& entry : read("z: 1\na: 2\nm: 3\n").root.entries) keys += entry.key;
    EXPECT_EQ(keys, "zam");
}

TEST(Document, ReportsADuplicateKeyAndKeepsTheFirst) {
    const Parsed parsed = read("a: 1\nb: {c: 1, c: 2}\na: 3\n");
    EXPECT_THAT(parsed.problems, StrEq("f.yaml:2:11: duplicate key 'c', already on line 2\n"
                                       "f.yaml:3:1: duplicate key 'a', already on line 1\n"));
    EXPECT_EQ(value(parsed.root, "a").scalar, "1");
    EXPECT_EQ(parsed.root.entries.size(), 2U);
}

TEST(Document, RefusesKeysThatAreNoWords) {
    EXPECT_EQ(read("? [a]\n: b\n").problems, "f.yaml:1:3: a key must be a word\n");
    EXPECT_EQ(read("{a: 1}: b\n").problems,
              "f.yaml:1:1: a key must be a word, not a map; a variable is written ${NAME}\n");
    const Parsed empty = read("~: x\nb: 1\n");
    EXPECT_EQ(empty.problems, "f.yaml:1:1: a key must be a word\n");
    EXPECT_EQ(empty.root.entries.size(), 1U);
}

TEST(Document, RefusesTags) {
    EXPECT_THAT(read("a: !foo x\n").problems,
                StrEq("f.yaml:1:4: a tag ('!foo') has no meaning here; leave it out, or put the "
                      "text in quotes\n"));
    EXPECT_THAT(read("a: !!int 3\n").problems, HasSubstr("f.yaml:1:4: a tag ("));
    EXPECT_THAT(read("a: !!map {b: 1}\n").problems, HasSubstr("f.yaml:1:4: a tag ("));
}

TEST(Document, RefusesASecondDocument) {
    EXPECT_EQ(read("a: 1\n---\nb: 2\n").problems,
              "f.yaml:2:1: a second document; the file must hold one only\n");
    EXPECT_EQ(read("a: 1\n---\n").problems,
              "f.yaml:2:1: a second document; the file must hold one only\n");
    EXPECT_THAT(read("---\na: 1\n").problems, IsEmpty());
    EXPECT_THAT(read("---\na: 1\n...\n").problems, IsEmpty());
    EXPECT_THAT(read("%YAML 1.2\n---\na: 1\n").problems, IsEmpty());
}

TEST(Document, TurnsASyntaxErrorIntoOneProblemAtItsCause) {
    EXPECT_EQ(read("a: b: c\n").problems,
              "f.yaml:1:4: two keys on one line; begin a deeper line for 'b', or write a: {b: c}; "
              "one text that holds ': ' must be in quotes: \"b: c\"\n"
              "  a: b: c\n"
              "     ^\n");
    EXPECT_EQ(read("lines: [\nb: 1\n").problems,
              "f.yaml:1:8: '[' is never closed; a ']' is missing after it\n"
              "  lines: [\n"
              "         ^\n");
    EXPECT_EQ(read("a:\tb\n\tc: d\n").problems,
              "f.yaml:2:1: a tab in the indentation; type blanks in its place\n"
              "  \tc: d\n"
              "  ^\n");
    EXPECT_EQ(read("a: b: c\n").root.kind, Node::Kind::null);
}

TEST(Document, RewordsParserErrorsThatNoLintExplains) {
    EXPECT_EQ(read("a: |0\n  b\n").problems,
              "f.yaml:1:6: 0 cannot follow | or >; leave it out\n"
              "  a: |0\n"
              "       ^\n");
}

TEST(Document, AForgottenQuoteTakesNothingAlong) {
    const Parsed parsed = read("a:\n  unit: \"celsius\n  b: 1\nc: 2\n");
    EXPECT_EQ(parsed.problems,
              "f.yaml:2:9: the quote \" opened here is not closed; write \"celsius\"\n"
              "    unit: \"celsius\n"
              "          ^\n");
    EXPECT_EQ(parsed.root.kind, Node::Kind::null);
    EXPECT_THAT(read("a: \"one\n  text\"\nb: 1\n").problems, IsEmpty());
}

TEST(Document, AnItemWithoutItsDashIsReportedOnce) {
    EXPECT_EQ(read("- id: 1\n  name: a\n  id: 2\n  name: b\n").problems,
              "f.yaml:3:3: duplicate key 'id', already on line 1; is a '- ' missing before it?\n");
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

TEST(Document, AnEmptyFileIsANullNode) {
    for (const char* text : {"", "\n", "# only a comment\n", "---\n"}) {
        const Parsed parsed = read(text);
        EXPECT_THAT(parsed.problems, IsEmpty()) << text;
        EXPECT_EQ(parsed.root.kind, Node::Kind::null) << text;
    }
}

TEST(Document, AnAliasRepeatsItsAnchorAtItsOwnPlace) {
    const Parsed parsed = read("a: &x {b: 1}\nc: *x\n");
    EXPECT_THAT(parsed.problems, IsEmpty());
    EXPECT_EQ(value(value(parsed.root, "c"), "b").scalar, "1");
    EXPECT_EQ(place(value(parsed.root, "c").mark), "2:4");
}

TEST(Document, RefusesAnAliasInsideItsAnchor) {
    EXPECT_EQ(read("a: &x [1, *x]\n").problems,
              "f.yaml:1:11: an alias must not be inside what it repeats\n");
}

TEST(Document, StopsAtNestingBombs) {
    for (const char* opening : {"[", "{a: ", "- ", "[{a: "}) {
        const Parsed parsed = read(repeat(opening, 100'000));
        EXPECT_THAT(parsed.problems, HasSubstr("nested deeper than 64 levels")) << opening;
        EXPECT_EQ(parsed.root.kind, Node::Kind::null) << opening;
    }
    EXPECT_THAT(read(repeat("[", 64) + repeat("]", 64)).problems, IsEmpty());
    EXPECT_THAT(read(repeat("[", 65) + repeat("]", 65)).problems,
                StrEq("f.yaml:1:65: nested deeper than 64 levels\n"));
}

TEST(Document, CountsBracketsBeforeTheParserDoes) {
    EXPECT_EQ(read(repeat("[", 4'000'000)).problems, "f.yaml:1:65: nested deeper than 64 levels\n");
}

TEST(Document, CountsTheDepthBehindAliases) {
    const std::string deep = repeat("[", 40) + repeat("]", 40);
    const std::string text = "a: &x " + deep + "\nb: " + repeat("[", 30) + "*x" + repeat("]", 30);
    EXPECT_EQ(read(text).problems, "f.yaml:2:34: nested deeper than 64 levels\n");
}

TEST(Document, StopsAtAliasesThatGrowWithoutEnd) {
    std::string text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
    for (int i = 1; i < 12; ++i) {
        const std::string before = "*a" + std::to_string(i - 1);
        const std::string name = "a" + std::to_string(i);
        text += name + ": &" + name + " [" + before + repeat(", " + before, 9) + "]\n";
    }
    EXPECT_THAT(read(text).problems, HasSubstr("more than 500000 values"));
}

TEST(Document, StopsAtAliasesThatRepeatALongText) {
    const std::string text = "a: &a " + repeat("x", 1'000'000) + "\nb: [*a" + repeat(", *a", 2'999);
    const std::string problems = read(text + "]\n").problems;
    EXPECT_EQ(problems,
              "f.yaml:2:13: more than 4 MiB of text, repetitions by aliases (*) included; "
              "repeat less\n");
}

TEST(Document, CountsLongKeysBehindAliases) {
    std::string text = "a: &a {";
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

TEST(Document, StopsAtAHugeFile) {
    EXPECT_THAT(read(repeat("- x\n", 500'001)).problems, HasSubstr("more than 500000 values"));
}

TEST(Document, SkipsAByteOrderMarkAndReadsWindowsLineEnds) {
    const Parsed parsed = read(
        "\xEF\xBB\xBF"
        "a: 1\r\nb: 2\r\n");
    EXPECT_THAT(parsed.problems, IsEmpty());
    EXPECT_EQ(value(parsed.root, "b").scalar, "2");
    EXPECT_EQ(place(value(parsed.root, "b").mark), "2:4");
}

TEST(Problems, AfterFiftyIsACount) {
    Problems problems("f");
    for (int i = 1; i <= 51; ++i) problems.add({i, 1}, "x");
    EXPECT_THAT(problems.text(), ::testing::EndsWith("f:51:1: x\n"));
    problems.add({52, 1}, "x");
    EXPECT_THAT(
        problems.text(),
        ::testing::EndsWith("f:50:1: x\nf:51:1: 2 more faults from here on; mend those above "
                            "and check again\n"));
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
