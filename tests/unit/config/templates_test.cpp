#include "templates.hpp"

#include <gtest/gtest.h>

#include <string>

#include "memory_files.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/config/settings.hpp"

namespace panelgate::config::templates_test {
namespace {

/// The tree after apply_templates(), and the problems.
struct Applied {
    yaml::Node tree;
    std::string problems;
    std::vector<std::string> warnings;
};

Applied apply(const std::string& text) {
    const MemoryFiles files({});
    yaml::Problems problems("f");
    Config config;
    Loading loading{files, problems, config, {}};
    Applied applied;
    applied.tree = yaml::parse(text, problems);
    apply_templates(loading, applied.tree);
    applied.problems = problems.text();
    applied.warnings = config.warnings;
    return applied;
}

/// Returns "key=value …" of a map; the length of a list.
std::string text_of(const yaml::Node& map) {
    std::string text;
    for (const yaml::Entry& entry : map.entries) {
        text += (text.empty() ? "" : " ") + entry.key + '=';
        if (entry.value.kind == yaml::Node::Kind::map) {
            text += '{' + text_of(entry.value) + '}';
        } else if (entry.value.kind == yaml::Node::Kind::sequence) {
            text += std::to_string(entry.value.items.size());
        } else {
            text += entry.value.scalar;
        }
    }
    return text;
}

/// Returns the only station of the only line.
std::string station_of(const std::string& templates, const std::string& station) {
    const Applied applied =
        apply("templates: " + templates + "\nlines: [{stations: [" + station + "]}]");
    if (!applied.problems.empty()) return applied.problems;
    return text_of(applied.tree.entries.at(0).value.items.at(0).entries.at(0).value.items.at(0));
}

TEST(ConfigTemplates, GiveWhatTheStationDoesNotSay) {
    EXPECT_EQ(station_of("{m: {profile: x, guard: true}}", "{id: 1, template: m, guard: false}"),
              "id=1 guard=false profile=x");
}

TEST(ConfigTemplates, PutMapsTogetherKeyByKey) {
    EXPECT_EQ(station_of("{m: {timing: {a: 1, b: 2}}}", "{template: m, timing: {b: 3}}"),
              "timing={b=3 a=1}");
}

TEST(ConfigTemplates, ReplaceLists) {
    EXPECT_EQ(station_of("{m: {points: [1, 2, 3]}}", "{template: m, points: [4]}"), "points=1");
    EXPECT_EQ(station_of("{m: {points: [1, 2, 3]}}", "{template: m, points: []}"), "points=0");
    EXPECT_EQ(station_of("{m: {points: [1, 2, 3]}}", "{template: m}"), "points=3");
}

TEST(ConfigTemplates, KeepTheirMarks) {
    const Applied applied =
        apply("templates:\n  m:\n    profile: x\nlines: [{stations: [{template: m}]}]");
    const yaml::Node& station =
        applied.tree.entries.at(0).value.items.at(0).entries.at(0).value.items.at(0);
    EXPECT_EQ(station.mark.line, 4);
    EXPECT_EQ(station.entries.at(0).mark.line, 3);
    EXPECT_EQ(station.entries.at(0).value.mark.column, 14);
}

TEST(ConfigTemplates, OfStrangeTreesNothingIsMade) {
    for (const std::string text :
         {"lines: 5", "lines: [5, {stations: 6}, {stations: [7]}]", "[1]", "x", "templates:"})
        EXPECT_EQ(apply(text).problems, "") << text;
}

TEST(ConfigTemplates, WhatTheyGiveInAllIsBounded) {
    std::string list = "x";
    for (int i = 1; i < 1000; ++i) list += ", x";
    std::string stations = "{template: m}";
    const std::size_t most = kMaxTemplateValues / 1000;
    for (std::size_t i = 1; i < 2 * most; ++i) stations += ", {template: m}";
    const std::string problem =
        apply("templates: {m: {points: [" + list + "]}}\nlines: [{stations: [" + stations + "]}]")
            .problems;
    EXPECT_NE(problem.find(": templates give more than 500000 values"), std::string::npos);
    EXPECT_EQ(problem.find('\n'), problem.size() - 1) << "once";
}

TEST(ConfigTemplates, LongTextsAreBoundedToo) {
    std::string stations = "{template: m}";
    for (int i = 1; i < 20; ++i) stations += ", {template: m}";
    const std::string problem = apply("templates: {m: {unit: " + std::string(1'000'000, 'x') +
                                      "}}\nlines: [{stations: [" + stations + "]}]")
                                    .problems;
    EXPECT_NE(problem.find("16 MiB of text"), std::string::npos);
}

}  // namespace
}  // namespace panelgate::config::templates_test
