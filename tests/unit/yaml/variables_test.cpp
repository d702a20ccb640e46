#include "panelgate/yaml/variables.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace panelgate::yaml::variables_test {
namespace {

std::optional<std::string> environment(const std::string& name) {
    const std::map<std::string, std::string> set{{"BAUD", "38400"},
                                                 {"EMPTY", ""},
                                                 {"TRICKY", "}, x: [1"},
                                                 {"LATIN",
                                                  "\xB0"
                                                  "C"}};
    const auto found = set.find(name);
    if (found == set.end()) return std::nullopt;
    return found->second;
}

/// Returns the value of `a` in a text such as "a: ${X}", or the problems.
std::string read(const std::string& text) {
    Problems problems("f");
    Node tree = parse(text, problems);
    expand_variables(tree, environment, problems);
    return problems.empty() ? tree.entries.at(0).value.scalar : problems.text();
}

TEST(YamlVariables, ComeFromTheEnvironment) {
    EXPECT_EQ(read("a: ${BAUD}"), "38400");
    EXPECT_EQ(read("a: x ${BAUD}/${BAUD} y"), "x 38400/38400 y");
    EXPECT_EQ(read("a: \"${BAUD}\""), "38400");
    EXPECT_EQ(read("a: ${EMPTY}"), "");
}

TEST(YamlVariables, HaveADefaultWhereTheyAreUnsetOrEmpty) {
    EXPECT_EQ(read("a: ${NO:-7}"), "7");
    EXPECT_EQ(read("a: ${EMPTY:-7}"), "7");
    EXPECT_EQ(read("a: ${BAUD:-7}"), "38400");
    EXPECT_EQ(read("a: ${NO:-}"), "");
    EXPECT_EQ(read("a: ${NO:-[::1]:502, # and {so} on}"), "[::1]:502, # and {so on}");
}

TEST(YamlVariables, ADefaultHoldsNoVariable) {
    for (const char* text : {"a: ${NO:-${BAUD}}", "a: \"/dev/${NO:-${BAUD:-x}}\""}) {
        Problems problems("f");
        Node tree = parse(text, problems);
        expand_variables(tree, environment, problems);
        EXPECT_EQ(
            problems.text(),
            "f:1:4: the default of NO holds a variable, which is not looked up; write a text\n")
            << text;
    }
}

TEST(YamlVariables, MayStandInFlowMapsAndLists) {
    Problems problems("f");
    Node tree = parse("{a: ${BAUD}, b: [${NO:-0.0.0.0:502}, \"${NO:-x, y}\"], c: 3}", problems);
    expand_variables(tree, environment, problems);
    ASSERT_EQ(problems.text(), "");
    ASSERT_EQ(tree.entries.size(), 3U);
    EXPECT_EQ(tree.entries[0].value.scalar, "38400");
    EXPECT_EQ(tree.entries[1].value.items.at(0).scalar, "0.0.0.0:502");
    EXPECT_EQ(tree.entries[1].value.items.at(1).scalar, "x, y");
    EXPECT_EQ(tree.entries[2].mark.column, 54);
}

TEST(YamlVariables, AreNeverReadAsYaml) { EXPECT_EQ(read("a: ${TRICKY}"), "}, x: [1"); }

TEST(YamlVariables, ADollarIsTwoDollarsOrStandsAlone) {
    EXPECT_EQ(read("a: $$"), "$");
    EXPECT_EQ(read("a: $${BAUD}"), "${BAUD}");
    EXPECT_EQ(read("a: 5 $ and $b"), "5 $ and $b");
}

TEST(YamlVariables, OnesThatAreNotSetAreProblemsAtTheirValue) {
    EXPECT_EQ(read("a: x\nb: {c: ${NO}}"),
              "f:2:8: the environment has no NO; set it, or write ${NO:-default}\n");
}

TEST(YamlVariables, WhatIsNeitherFormIsAProblem) {
    const std::string wanted =
        " must be ${NAME} or ${NAME:-default}, NAME of letters, digits and '_'; a dollar itself is "
        "$$\n";
    for (const std::string form : {"${}", "${1X}", "${A-b}", "${A:b}", "${A B}"})
        EXPECT_EQ(read("a: " + form), "f:1:4: '" + form + '\'' + wanted);
    EXPECT_EQ(read("a: '${A'"), "f:1:4: '${A'" + wanted);
}

TEST(YamlVariables, WhatIsNoUtf8IsAProblem) {
    EXPECT_EQ(read("a: ${LATIN}"), "f:1:4: what the environment has as LATIN is not UTF-8\n");
}

TEST(YamlVariables, KeysStayAsTheyAre) {
    Problems problems("f");
    Node tree = parse("${BAUD}: 1", problems);
    expand_variables(tree, environment, problems);
    EXPECT_EQ(tree.entries.at(0).key, "${BAUD}");
}

TEST(YamlVariables, NothingIsSetWithoutAnEnvironment) {
    Problems problems("f");
    Node tree = parse("a: ${BAUD}\nb: ${BAUD:-1}", problems);
    expand_variables(tree, {}, problems);
    EXPECT_EQ(problems.list().size(), 1U);
    EXPECT_EQ(tree.entries.at(1).value.scalar, "1");
}

TEST(YamlVariables, WhatTheyBringIsBounded) {
    const std::string large(600'000, 'x');
    Problems problems("f");
    Node tree = parse("[$A, ${A}, ${A}, ${A}]", problems);
    expand_variables(tree, [&](const std::string&) { return large; }, problems);
    EXPECT_EQ(problems.text(), "f:1:12: variables bring more than 1048576 bytes\n");
}

}  // namespace
}  // namespace panelgate::yaml::variables_test
