#include "panelgate/yaml/variables.hpp"

#include <gtest/gtest.h>

#include <string>

namespace panelgate::yaml::merge_keys_test {
namespace {

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
    EXPECT_EQ(merged("d: &d {a: 1, b: 2}\nm: {<<: *d, b: 3, c: 4}"), "b=3 c=4 a=1");
    EXPECT_EQ(merged("d: &d {a: 1}\nm:\n  <<: *d\n"), "a=1");
}

TEST(YamlMergeKeys, OfAListTheFirstWins) {
    EXPECT_EQ(merged("d: &d {a: 1}\ne: &e {a: 2, b: 3}\nm: {<<: [*d, *e]}"), "a=1 b=3");
}

TEST(YamlMergeKeys, MayBeBuiltOnEachOther) {
    EXPECT_EQ(merged("d: &d {a: 1}\ne: &e {<<: *d, b: 2}\nm: {<<: *e, c: 3}"), "c=3 b=2 a=1");
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
}  // namespace panelgate::yaml::merge_keys_test
