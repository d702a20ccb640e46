#include "panelgate/yaml/variables.hpp"

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>
#include <utility>

namespace panelgate::yaml::variables_test {
namespace {

std::optional<std::string> environment(const std::string& name) {
    static const std::map<std::string, std::string> kSet{
        {"BAUD", "38400"}, {"EMPTY", ""}, {"TRICKY", "}, x: [1"}, {"LATIN", "\xB0 C"}};
    const auto found = kSet.find(name);
    if (found == kSet.end()) return std::nullopt;
    return found->second;
}

/// Returns the value of `a` in a text such as "a: ${X}", or the problems.
std::string read(const std::string& text, const Environment& from = environment) {
    Problems problems("f");
    Node tree = parse(text, problems);
    expand_variables(tree, from, problems);
    return problems.empty() ? tree.entries.at(0).value.scalar : problems.text();
}

TEST(YamlVariables, ComeFromTheEnvironmentOrTheirDefault) {
    const std::pair<const char*, const char*> rows[] = {
        {"a: ${BAUD}", "38400"},
        {"a: x ${BAUD}/${BAUD} y", "x 38400/38400 y"},
        {"a: \"${BAUD}\"", "38400"},
        {"a: ${EMPTY}", ""},
        {"a: ${NO:-7}", "7"},
        {"a: ${EMPTY:-7}", "7"},
        {"a: ${BAUD:-7}", "38400"},
        {"a: ${NO:-}", ""},
        {"a: ${NO:-[::1]:502, # and {so on}", "[::1]:502, # and {so on"},
        {"a: ${TRICKY}", "}, x: [1"},  // it is never read as YAML
        {"a: $$", "$"},                // a dollar is two, or stands alone
        {"a: $${BAUD}", "${BAUD}"},
        {"a: 5 $ and $b", "5 $ and $b"},
    };
    for (const auto& [text, value] : rows) EXPECT_EQ(read(text), value) << text;
}

TEST(YamlVariables, WhatCannotBeLookedUpIsAProblemAtItsValue) {
    const std::string holds =
        "f:1:4: the default of NO holds a variable, which is not looked up; write a text\n";
    const std::string unset = " the environment has no NO; set it, or write ${NO:-default}\n";
    const std::string forms =
        " must be ${NAME} or ${NAME:-default}, NAME of letters, digits and '_'; a dollar itself is "
        "$$\n";
    const std::pair<const char*, std::string> rows[] = {
        {"a: ${NO:-${BAUD}}", holds},
        {"a: \"/dev/${NO:-${BAUD:-x}}\"", holds},
        {"a: x\nb: {c: ${NO}}", "f:2:8:" + unset},
        {"a: ${LATIN}", "f:1:4: what the environment has as LATIN is not UTF-8\n"},
        {"a: '${A'", "f:1:4: '${A'" + forms},
    };
    for (const auto& [text, problem] : rows) EXPECT_EQ(read(text), problem) << text;
    for (const std::string form : {"${}", "${1X}", "${A-b}", "${A:b}", "${A B}"})
        EXPECT_EQ(read("a: " + form), "f:1:4: '" + form + '\'' + forms);
    EXPECT_EQ(read("a: ${NO}", {}), "f:1:4:" + unset);
    EXPECT_EQ(read("a: ${BAUD:-1}", {}), "1") << "nothing is set without an environment";
}

TEST(YamlVariables, MayStandInFlowMapsAndListsButNotInKeys) {
    Problems problems("f");
    Node tree = parse("{a: ${BAUD}, b: [${NO:-0.0.0.0:502}, \"${NO:-x, y}\"], c: 3}", problems);
    expand_variables(tree, environment, problems);
    ASSERT_EQ(problems.text(), "");
    ASSERT_EQ(tree.entries.size(), 3U);
    EXPECT_EQ(tree.entries[0].value.scalar, "38400");
    EXPECT_EQ(tree.entries[1].value.items.at(0).scalar, "0.0.0.0:502");
    EXPECT_EQ(tree.entries[1].value.items.at(1).scalar, "x, y");
    EXPECT_EQ(tree.entries[2].mark.column, 54);
    tree = parse("${BAUD}: 1", problems);
    expand_variables(tree, environment, problems);
    EXPECT_EQ(tree.entries.at(0).key, "${BAUD}");
}

TEST(YamlVariables, WhatTheyBringIsBounded) {
    const std::string large(600'000, 'x');
    EXPECT_EQ(read("[$A, ${A}, ${A}, ${A}]", [&](const std::string&) { return large; }),
              "f:1:12: variables bring more than 1048576 bytes\n");
}

/// Returns "key=value …" of the map under `m`, or the problems.
std::string merged(const std::string& text) {
    Problems problems("f");
    Node tree = parse(text, problems);
    resolve_merge_keys(tree, problems);
    if (!problems.empty()) return problems.text();
    std::string keys;
    for (const Entry& entry : tree.entries.back().value.entries)
        keys += (keys.empty() ? "" : " ") + entry.key + '=' + entry.value.scalar;
    return keys;
}

TEST(YamlMergeKeys, TakeOverWhatTheMapDoesNotSayItself) {
    const std::pair<const char*, const char*> rows[] = {
        {"d: &d {a: 1, b: 2}\nm: {<<: *d, b: 3, c: 4}", "b=3 c=4 a=1"},
        {"d: &d {a: 1}\nm:\n  <<: *d\n", "a=1"},
        // Of a list the first wins.
        {"d: &d {a: 1}\ne: &e {a: 2, b: 3}\nm: {<<: [*d, *e]}", "a=1 b=3"},
        // They may be built on each other.
        {"d: &d {a: 1}\ne: &e {<<: *d, b: 2}\nm: {<<: *e, c: 3}", "c=3 b=2 a=1"},
    };
    for (const auto& [text, keys] : rows) EXPECT_EQ(merged(text), keys) << text;
}

TEST(YamlMergeKeys, TakenOverKeysKeepTheirMarks) {
    Problems problems("f");
    Node tree = parse("d: &d\n  a: 1\nm: {<<: *d}", problems);
    resolve_merge_keys(tree, problems);
    const Entry& taken = tree.entries.at(1).value.entries.at(0);
    EXPECT_EQ(taken.mark.line, 2);
    EXPECT_EQ(taken.value.mark.column, 6);
}

TEST(YamlMergeKeys, WantMaps) {
    const std::string wanted =
        "'<<' takes over a map of keys, such as <<: *name, or a list of such: <<: [*one, *other]\n";
    EXPECT_EQ(merged("m: {<<: 5}"), "f:1:9: " + wanted);
    EXPECT_EQ(merged("m: {<<: [{a: 1}, 5]}"), "f:1:18: " + wanted);
    EXPECT_EQ(merged("m:\n  <<:\n  a: 1"), "f:2:3: " + wanted);
}

}  // namespace
}  // namespace panelgate::yaml::variables_test
