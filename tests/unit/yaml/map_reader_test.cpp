#include "panelgate/yaml/map_reader.hpp"

#include <gmock/gmock.h>

#include <array>
#include <cstdint>
#include <optional>
#include <regex>
#include <string>
#include <string_view>
#include <utility>

namespace panelgate::yaml::map_reader_test {
namespace {

using ::testing::IsEmpty;

enum class Fruit { apple, pear };
constexpr std::array<std::pair<std::string_view, Fruit>, 2> kFruits{
    {{"apple", Fruit::apple}, {"pear", Fruit::pear}}};

/// A reader with its own document.
class Subject {
  public:
    explicit Subject(std::string_view text) : node_(parse(text, problems_)) {}

    MapReader& read() { return reader_; }
    std::string problems() const { return problems_.text(); }

  private:
    Problems problems_{"f"};
    Node node_;
    MapReader reader_{node_, problems_, "thing"};
};

TEST(MapReader, ReadsTextQuotedOrNot) {
    Subject s("a: ''\nb:\nc: [1]\nd: 010\ne: '010'\n");
    for (const char* key : {"d", "e"}) EXPECT_EQ(s.read().text(key), "010");
    for (const char* key : {"a", "b", "c", "absent"}) EXPECT_EQ(s.read().text(key), std::nullopt);
    EXPECT_EQ(s.problems(),
              "f:1:4: a must not be empty\n"
              "f:2:1: b has no value; it must be a text\n"
              "f:3:4: c must be a text, not a list\n");
}

TEST(MapReader, ReportsWhichRequiredKeyIsMissing) {
    Subject s("  a: 1\n");
    EXPECT_EQ(s.read().required_text("name"), std::nullopt);
    EXPECT_EQ(s.read().required_integer("id", 1, 9), std::nullopt);
    EXPECT_EQ(s.read().required_integer("a", 1, 9), 1);
    EXPECT_EQ(s.read().required_text("a"), "1");
    EXPECT_EQ(s.problems(), "f:1:3: thing needs 'name'\nf:1:3: thing needs 'id'\n");
}

TEST(MapReader, ReportsAMissingKeyDespiteASimilarOne) {
    Subject s("node: 1\n");
    EXPECT_EQ(s.read().required_text("mode"), std::nullopt);
    EXPECT_EQ(s.read().text("node"), "1");
    s.read().finish();
    EXPECT_EQ(s.problems(), "f:1:1: thing needs 'mode'\n");
}

TEST(MapReader, ReadsWholeNumbersInRangeAndNoOtherSpelling) {
    Subject s(
        "a: 10\nb: 007\nc: '7'\nd: 0x7\ne: 7.0\nf: many\ng: 99999999999999999999\nh:\n"
        "x: 0\ny: -5\nz: 4096\n");
    EXPECT_EQ(s.read().integer("x", 0, 9), 0);
    EXPECT_EQ(s.read().integer("y", -5, 9), -5);
    EXPECT_EQ(s.read().integer("z", 1, 4096), 4096);
    for (const char* key : {"a", "b", "c", "d", "e", "f", "g", "h"})
        EXPECT_EQ(s.read().integer(key, 1, 9), std::nullopt) << key;
    EXPECT_EQ(s.problems(),
              "f:1:4: a must be a whole number from 1 to 9, not '10'\n"
              "f:2:4: b must be a whole number from 1 to 9, not '007' (no leading zeros)\n"
              "f:3:4: c must be a whole number from 1 to 9, not '7' in quotes; write 7 without\n"
              "f:4:4: d must be a whole number from 1 to 9, not '0x7'; write 7\n"
              "f:5:4: e must be a whole number from 1 to 9, not '7.0'; write 7\n"
              "f:6:4: f must be a whole number from 1 to 9, not 'many'\n"
              "f:7:4: g must be a whole number from 1 to 9, not '99999999999999999999'\n"
              "f:8:1: h has no value; it must be a whole number from 1 to 9\n");
}

TEST(MapReader, ReadsNumbersWithAFraction) {
    Subject s("a: 0.1\nb: -3\nc: 1e3\nd: 00.5\ne: nan\nf: '1'\ng: 1,5\nh: -01\n");
    EXPECT_EQ(s.read().number("a"), 0.1);
    EXPECT_EQ(s.read().number("b"), -3.0);
    EXPECT_EQ(s.read().number("c"), 1000.0);
    for (const char* key : {"d", "e", "f", "g", "h"}) EXPECT_EQ(s.read().number(key), std::nullopt);
    EXPECT_EQ(s.problems(),
              "f:4:4: d must be a number, not '00.5' (no leading zeros)\n"
              "f:5:4: e must be a number, not 'nan'\n"
              "f:6:4: f must be a number, not '1' in quotes; write 1 without\n"
              "f:7:4: g must be a number, not '1,5'; write 1.5\n"
              "f:8:4: h must be a number, not '-01' (no leading zeros)\n");
}

TEST(MapReader, ReadsSharesFromNothingToAll) {
    Subject s("a: 0.25\nb: 1\nc: 1.5\nd: -0.1\ne: x\n");
    EXPECT_EQ(s.read().share("a"), 0.25);
    EXPECT_EQ(s.read().share("b"), 1);
    for (const char* key : {"c", "d", "e", "absent"}) EXPECT_EQ(s.read().share(key), std::nullopt);
    EXPECT_EQ(s.problems(),
              "f:3:4: c must be a share from 0 to 1, such as 0.1 for 10 %\n"
              "f:4:4: d must be a share from 0 to 1, such as 0.1 for 10 %\n"
              "f:5:4: e must be a number, not 'x'\n");
}

TEST(MapReader, KnowsTrueAndFalseOnly) {
    Subject s("a: true\nb: false\nc: yes\nd: 'true'\ne: tRue\nf: True\ng: FALSE\n");
    for (const char* key : {"a", "f"}) EXPECT_EQ(s.read().boolean(key), true);
    for (const char* key : {"b", "g"}) EXPECT_EQ(s.read().boolean(key), false);
    for (const char* key : {"c", "d", "e"}) EXPECT_EQ(s.read().boolean(key), std::nullopt);
    EXPECT_EQ(s.problems(),
              "f:3:4: c must be true or false, not 'yes'; write true\n"
              "f:4:4: d must be true or false, not 'true'; write true without quotes\n"
              "f:5:4: e must be true or false, not 'tRue'; write true\n");
}

TEST(MapReader, ReadsDurationsWithTheirUnitAndAsksForIt) {
    Subject s(
        "response_timeout: 300\nb: 3 s\nc: 11min\nd: 1.5s\ne: fast\n"
        "w: 250us\nx: 20ms\ny: 2s\nz: 5min\n");
    const std::pair<const char*, Duration> good[] = {
        {"w", 250us}, {"x", 20ms}, {"y", 2s}, {"z", 5min}};
    for (const auto& [key, expected] : good)
        EXPECT_EQ(s.read().duration(key, 0s, 10min), expected) << key;
    for (const char* key : {"response_timeout", "b", "c", "d", "e"})
        EXPECT_EQ(s.read().duration(key, 1ms, 10min), std::nullopt);
    EXPECT_EQ(s.problems(),
              "f:1:19: response_timeout must be a duration such as 300ms, not '300' (add a unit: "
              "us, ms, s, min)\n"
              "f:2:4: b must be a duration such as 300ms, not '3 s'; write 3s\n"
              "f:3:4: c must be from 1ms to 10min, not '11min'\n"
              "f:4:4: d must be a duration such as 300ms, not '1.5s'; write 1500ms\n"
              "f:5:4: e must be a duration such as 300ms, not 'fast'\n");
}

TEST(MapReader, ReadsOneOfTheWords) {
    Subject s("a: pear\nb: peer\nc: stone\nd:\n");
    EXPECT_EQ(s.read().choice<Fruit>("a", kFruits), Fruit::pear);
    for (const char* key : {"b", "c", "d", "absent"})
        EXPECT_EQ(s.read().choice<Fruit>(key, kFruits), std::nullopt);
    EXPECT_EQ(s.problems(),
              "f:2:4: b must be apple or pear, not 'peer'; did you mean 'pear'?\n"
              "f:3:4: c must be apple or pear, not 'stone'\n"
              "f:4:1: d has no value; it must be apple or pear\n");
}

TEST(MapReader, HandsOutChildren) {
    Subject s("a: {b: 1}\nc: [1, 2]\nd: 5\ne:\n");
    ASSERT_NE(s.read().map("a"), nullptr);
    EXPECT_EQ(s.read().map("a")->entries[0].key, "b");
    ASSERT_NE(s.read().sequence("c"), nullptr);
    EXPECT_EQ(s.read().sequence("c")->items.size(), 2U);
    EXPECT_NE(s.read().child("d"), nullptr);
    for (const char* key : {"e", "absent"}) EXPECT_EQ(s.read().child(key), nullptr);
    EXPECT_EQ(s.read().map("e"), nullptr);
    EXPECT_THAT(s.problems(), IsEmpty());
    EXPECT_EQ(s.read().map("c"), nullptr);
    EXPECT_EQ(s.read().sequence("d"), nullptr);
    EXPECT_EQ(s.problems(),
              "f:2:4: c must be a map of keys, not a list\n"
              "f:3:4: d must be a list, not '5'; write [5], or '- ' before each item\n");
}

TEST(MapReader, PointsAtValuesAndAtTheMapForAbsentKeys) {
    Subject s("\n a: 1\n c:\n");
    EXPECT_TRUE(s.read().has("a"));
    EXPECT_FALSE(s.read().has("b"));
    EXPECT_TRUE(s.read().has("c"));
    EXPECT_EQ(s.read().mark("a").column, 5);
    EXPECT_EQ(s.read().mark("b").column, 2);
    s.read().problem("a", "odd");
    s.read().problem("b", "absent");
    EXPECT_EQ(s.problems(), "f:2:2: absent\nf:2:5: odd\n");
}

TEST(MapReader, LooksForWhatWasMeantByAsManyKeysAsAreShown) {
    std::string text;
    for (int i = 0; i < 200; ++i) text += "baudd" + std::to_string(i) + ": 1\n";
    Problems problems("f");
    const Node node = parse(text, problems);
    MapReader in(node, problems, "thing");
    in.integer("baudd", 0, 1);
    in.finish();
    ASSERT_EQ(problems.list().size(), 200U);
    EXPECT_EQ(problems.list().front().message,
              "unknown key 'baudd0' in thing; did you mean 'baudd'?");
    EXPECT_EQ(problems.list().back().message, "unknown key 'baudd199' in thing");
}

TEST(MapReader, ReportsUnknownKeysWithTheNearestKnownOneOrAllIfNoneIsNear) {
    Subject s("bauds: 1\nparity: none\nfoo: 1\n? \"line\\nbreak\"\n: 1\n");
    for (const char* key : {"baud", "data_bits", "parity", "stop_bits"}) s.read().text(key);
    s.read().finish();
    EXPECT_EQ(s.problems(),
              "f:1:1: unknown key 'bauds' in thing; did you mean 'baud'?\n"
              "f:3:1: unknown key 'foo' in thing; known keys are baud, data_bits, parity, "
              "stop_bits\n"
              "f:4:3: unknown key 'line break' in thing; known keys are baud, data_bits, parity, "
              "stop_bits\n");
}

TEST(MapReader, ReportsOnceThatANodeIsNoMap) {
    Subject s("[1, 2]\n");
    EXPECT_EQ(s.read().required_text("name"), std::nullopt);
    EXPECT_EQ(s.read().integer("id", 1, 2), std::nullopt);
    s.read().finish();
    EXPECT_EQ(s.problems(), "f:1:1: thing must be a map of keys, not a list\n");
}

TEST(TextForms, ParseIntegersStrictly) {
    EXPECT_EQ(parse_integer("0"), 0);
    EXPECT_EQ(parse_integer("-12"), -12);
    EXPECT_EQ(parse_integer("9223372036854775807"), INT64_MAX);
    for (const char* text :
         {"", "-", "+1", "01", "-01", "-0", "1 ", " 1", "1e3", "9223372036854775808"})
        EXPECT_EQ(parse_integer(text), std::nullopt) << text;
}

TEST(TextForms, ParseDurationsStrictly) {
    EXPECT_EQ(parse_duration("0ms"), Duration(0));
    EXPECT_EQ(parse_duration("90min"), Duration(90min));
    for (const char* text : {"", "ms", "5", "5h", "5ns", "05ms", "-5ms", "5 ms", "5MS",
                             "999999999999s", "99999999999999999999s"})
        EXPECT_EQ(parse_duration(text), std::nullopt) << text;
}

TEST(TextForms, PatternsOfIntegersTakeTheRangeAndNothingElse) {
    using Range = std::pair<std::int64_t, std::int64_t>;
    for (const auto& [min, max] : {Range{0, 255}, Range{1, 247}, Range{0, 0}, Range{7, 7},
                                   Range{9, 10}, Range{100, 996}, Range{999, 1001}}) {
        const std::regex pattern('^' + integer_pattern(min, max) + '$');
        for (std::int64_t i = 0; i <= 1010; ++i)
            ASSERT_EQ(std::regex_search(std::to_string(i), pattern), i >= min && i <= max)
                << i << " in " << integer_pattern(min, max);
        for (const char* text : {"", "-1", "-0", "+1", "01", "1 ", "x"})
            ASSERT_FALSE(std::regex_search(text, pattern)) << text;
    }
}

TEST(TextForms, PatternsOfDurationsTakeWhatIsParsedAndInRange) {
    using Range = std::pair<Duration, Duration>;
    for (const auto& [min, max] : {Range{0ms, 10s}, Range{1ms, 2min}, Range{5s, 1h}, Range{1s, 24h},
                                   Range{0ms, 100ms}, Range{10ms, 10min}}) {
        const std::string typed_range = duration_pattern(min, max);
        const std::regex pattern(typed_range);
        for (const char* unit : {"us", "ms", "s", "min"}) {
            for (const std::int64_t n :
                 {0,       1,       2,       4,          5,         9,     10,    11,
                  60,      99,      100,     101,        119,       120,   121,   999,
                  1000,    1440,    1441,    3600,       3601,      86400, 86401, 100'000,
                  100'001, 120'000, 120'001, 10'000'000, 10'000'001}) {
                const std::string text = std::to_string(n) + unit;
                const Duration typed = *parse_duration(text);
                EXPECT_EQ(std::regex_search(text, pattern), typed >= min && typed <= max)
                    << text << " in " << typed_range;
            }
        }
        for (const char* text : {"", "5", "05s", "5 s", "5h", "-5s", "1.5s", "5s ", "1000000001us"})
            EXPECT_FALSE(std::regex_search(text, pattern)) << text;
    }
}

TEST(TextForms, FormatDurationsInTheLargestExactUnit) {
    EXPECT_EQ(format_duration(0s), "0ms");
    EXPECT_EQ(format_duration(1500ms), "1500ms");
    EXPECT_EQ(format_duration(2s), "2s");
    EXPECT_EQ(format_duration(250us), "250us");
    EXPECT_EQ(format_duration(10min), "10min");
    EXPECT_EQ(format_duration(2005209ns), "2005209ns");
}

}  // namespace
}  // namespace panelgate::yaml::map_reader_test
