#include "panelgate/yaml/insert.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::yaml::insert_test {
namespace {

using ::testing::HasSubstr;

Node text_node(std::string text) {
    Node node;
    node.kind = Node::Kind::scalar;
    node.quoted = true;
    node.scalar = std::move(text);
    return node;
}

Node number_node(std::string digits) {
    Node node = text_node(std::move(digits));
    node.quoted = false;
    return node;
}

/// {name: new, id: 9}
Node item() {
    Node map;
    map.kind = Node::Kind::map;
    map.entries.push_back({"name", {}, text_node("new")});
    map.entries.push_back({"id", {}, number_node("9")});
    return map;
}

/// The longer text, or why there is none.
std::string inserted(const std::string& text, std::string_view into, const Node& node = item()) {
    Problems problems("f.yaml");
    const auto made = insert(text, into, node, problems);
    if (!made) return "REFUSED: " + problems.text();
    std::string longer = text;
    return longer.insert(made->at, made->text);
}

TEST(Insert, FollowsTheStyleOfTheItemsBefore) {
    EXPECT_EQ(inserted("a:\n  - {name: x, id: 1}   # one\n\n# next\nb: 1\n", "a"),
              "a:\n  - {name: x, id: 1}   # one\n  - {name: new, id: 9}\n\n# next\nb: 1\n");
    EXPECT_EQ(inserted("a:\n- name: x\n  id: 1\n", "a"),
              "a:\n- name: x\n  id: 1\n- name: new\n  id: 9\n");
    EXPECT_EQ(
        inserted("a:\n    -   name: x\n\n    -   name: y\n        # more of y\n\nb: 1\n", "a"),
        "a:\n    -   name: x\n\n    -   name: y\n        # more of y\n\n    -   name: new\n"
        "        id: 9\n\nb: 1\n");
    EXPECT_EQ(inserted("a: [{ name: x }]\n", "a"), "a: [{ name: x }, { name: new, id: 9 }]\n");
    EXPECT_EQ(inserted("a: [\n  {name: x},\n  {name: y},\n]\n", "a"),
              "a: [\n  {name: x},\n  {name: y},\n  {name: new, id: 9}\n]\n");
}

TEST(Insert, GoesByKeysAndNames) {
    const std::string lines =
        "lines:\n"
        "  - name: one\n"
        "    stations:\n"
        "      - {name: press, id: 1}\n"
        "    # of the second line\n"
        "  - name: two\n"
        "    stations: [{name: oven, id: 2}]\n";
    EXPECT_THAT(inserted(lines, "lines/one/stations"),
                HasSubstr("id: 1}\n      - {name: new, id: 9}\n    # of the second line\n"));
    EXPECT_THAT(inserted(lines, "lines/two/stations"), HasSubstr("[{name: oven, id: 2}, {name"));
    EXPECT_THAT(inserted(lines, "lines/two/stations/oven/points"),
                HasSubstr("id: 2, points: [{name: new, id: 9}]}]"));
    EXPECT_THAT(inserted(lines, "lines/three/stations"), HasSubstr("'three' is not there"));
    EXPECT_THAT(inserted(lines, "lines/one/name"), HasSubstr("is no list"));
}

TEST(Insert, BeginsAMissingList) {
    EXPECT_EQ(inserted("a:   # none yet\nb: 1\n", "a"),
              "a:   # none yet\n  - name: new\n    id: 9\nb: 1\n");
    EXPECT_EQ(inserted("a: []\n", "a"), "a: [{name: new, id: 9}]\n");
    EXPECT_EQ(
        inserted("a:\n  - b:\n    - {c: 1}\n  - name: x\n    d: 1\n", "a/x/b"),
        "a:\n  - b:\n    - {c: 1}\n  - name: x\n    d: 1\n    b:\n    - {name: new, id: 9}\n");
}

TEST(Insert, KeepsLineEndsMarksAndAMissingLastNewline) {
    EXPECT_EQ(inserted("\xEF\xBB\xBF"
                       "a:\r\n  - {name: x}\r\n",
                       "a"),
              "\xEF\xBB\xBF"
              "a:\r\n  - {name: x}\r\n  - {name: new, id: 9}\r\n");
    EXPECT_EQ(inserted("a:\n  - {name: x}", "a"), "a:\n  - {name: x}\n  - {name: new, id: 9}");
    EXPECT_EQ(inserted("a:\n  - {name: \"\xC3\x96l # ]}\", b: [1]}\n", "a/\xC3\x96l # ]}/b"),
              "a:\n  - {name: \"\xC3\x96l # ]}\", b: [1, {name: new, id: 9}]}\n");
}

TEST(Insert, RefusesWhatWouldChangeMore) {
    const std::string shared = "b: &s\n  - {name: x}\na: *s\n";
    EXPECT_THAT(inserted(shared, "a"), HasSubstr("repeated by an alias"));
    EXPECT_THAT(inserted(shared, "b"), HasSubstr("nothing can be put in here"));
    EXPECT_THAT(inserted("m: &m {b: []}\na:\n  <<: *m\n", "a/b"), HasSubstr("from an alias"));
    EXPECT_THAT(inserted("a: [1\n", "a"), HasSubstr("f.yaml:"));
}

TEST(Insert, SaysWhereTheItemBegins) {
    Problems problems("f.yaml");
    EXPECT_EQ(insert("a:\n  - {name: x}\n# end\n", "a", item(), problems)->line, 3);
    EXPECT_EQ(insert("a:\n  name: x", "a/b", item(), problems)->line, 4);
}

/// The places of a tree where a list of maps is, or may begin.
void add_places(const Node& node, const std::string& path, std::vector<std::string>& places) {
    if (node.kind == Node::Kind::map) places.push_back(path + "new_list");
    for (const Entry& entry : node.entries) {
        const bool maps =
            !entry.value.items.empty() && entry.value.items.front().kind == Node::Kind::map;
        if (maps) places.push_back(path + entry.key);
        add_places(entry.value, path + entry.key + '/', places);
    }
    for (const Node& one : node.items)
        if (const Node* name = one.find("name")) add_places(one, path + name->scalar + '/', places);
}

/// All YAML of this tree: configurations, and the blocks of its pages.
std::vector<std::string> examples() {
    namespace fs = std::filesystem;
    std::vector<std::string> texts;
    for (const char* folder : {"config", "docs", "deploy", "tests"}) {
        for (const auto& file : fs::recursive_directory_iterator(fs::path(SOURCE_ROOT) / folder)) {
            const std::string kind = file.path().extension();
            if (kind != ".yaml" && kind != ".md") continue;
            std::ifstream in(file.path());
            std::string text{std::istreambuf_iterator<char>(in), {}};
            if (kind == ".yaml") texts.push_back(std::move(text));
            if (kind == ".yaml") continue;
            constexpr std::string_view kFence = "```yaml\n";
            for (auto at = text.find(kFence); at != text.npos; at = text.find(kFence, at + 1)) {
                const auto from = at + kFence.size();
                texts.push_back(text.substr(from, text.find("```", from) - from));
            }
        }
    }
    return texts;
}

TEST(Insert, LeavesEveryOtherByteOfAllExamples) {
    struct Place {
        const std::string* text;
        std::string path;
    };
    const std::vector<std::string> texts = examples();
    std::vector<Place> places;
    for (const std::string& text : texts) {
        Problems problems("f.yaml");
        const Node root = parse(text, problems);
        std::vector<std::string> paths;
        if (problems.empty()) add_places(root, "", paths);
        for (std::string& path : paths) places.push_back({&text, std::move(path)});
    }
    std::mt19937 random(49);
    int done = 0;
    for (int i = 0; i < 1000; ++i) {
        const auto& [text, path] = places.at(random() % places.size());
        Problems problems("f.yaml");
        const auto made = insert(*text, path, item(), problems);
        if (!made) {
            EXPECT_THAT(problems.text(), HasSubstr("alias")) << path << "\n" << *text;
            continue;
        }
        ++done;
        std::string longer = *text;
        longer.insert(made->at, made->text);
        const Node now = parse(longer, problems);
        ASSERT_TRUE(problems.empty()) << problems.text() << longer;
        longer.erase(made->at, made->text.size());
        ASSERT_EQ(longer, *text);
    }
    EXPECT_GT(texts.size(), 50U);
    EXPECT_GT(done, 950) << "of 1,000";
}

}  // namespace
}  // namespace panelgate::yaml::insert_test
