#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "golden_cases.hpp"
#include "memory_files.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config::golden_test {
namespace {

namespace fs = std::filesystem;

const fs::path kFolder = fs::path(SOURCE_ROOT) / "tests/golden/config";

struct Place {
    fs::path file;
    std::string name;
};
void PrintTo(const Place& place, std::ostream* out) { *out << place.file.filename() << place.name; }

std::vector<fs::path> files() {
    std::vector<fs::path> paths;
    for (const fs::directory_entry& entry : fs::directory_iterator(kFolder))
        paths.push_back(entry.path());
    std::ranges::sort(paths);
    return paths;
}

std::vector<Place> places() {
    std::vector<Place> all;
    for (const fs::path& file : files()) {
        for (const GoldenCase& one : parse_golden(read_text(file)).cases)
            all.push_back({file, one.name});
    }
    return all;
}

std::optional<std::string> environment(const std::string& name) {
    static const std::map<std::string, std::string> kSet{{"BAUD", "38400"},
                                                         {"BELL", "\a"},
                                                         {"LIST", "[10.0.0.0/8, 192.168.0.0/16]"},
                                                         {"PAIR", "10.0.0.0/8,192.168.0.0/16"},
                                                         {"MAP", "{baud: 9600}"},
                                                         {"RATE", "9,600"},
                                                         {"LINES", "/dev/ttyUSB0\nname: x"}};
    const auto found = kSet.find(name);
    return found == kSet.end() ? std::nullopt : std::optional(found->second);
}

/// Returns the messages: the problems, or the warnings of a valid file.
std::string told(const std::string& configuration) {
    const MemoryFiles files({{"/run/secrets/ops", "  secret-0123456789 \n"},
                             {"/run/secrets/marked", "\xef\xbb\xbfsecret-0123456789\r\n"},
                             {"/run/secrets/wide", std::string("\xff\xfes\0e\0c\0", 8)},
                             {"/run/secrets/mounted", "secret-0123456789\n"},
                             {"/run/secrets/short", "secret\n"},
                             {"/public/ops", "secret-0123456789\n"},
                             {"/run/secrets/empty", " \n"},
                             {"/run/secrets/two", "one two\n"},
                             {"/etc/panelgate/profiles/broken.yaml", "descriptions: x: y\n"}});
    yaml::Problems problems("panelgate.yaml");
    const auto config = load(configuration, files, problems, environment);
    EXPECT_EQ(config.has_value(), problems.empty());
    if (!config) return problems.text();
    std::string warnings;
    for (const std::string& warning : config->warnings) warnings += warning + '\n';
    return warnings;
}

class ConfigGolden : public ::testing::TestWithParam<Place> {};

/// With PANELGATE_WRITE_GOLDEN in the environment it writes the texts instead: review them.
TEST_P(ConfigGolden, SaysExactlyThis) {
    GoldenFile file = parse_golden(read_text(GetParam().file));
    GoldenCase& one = file.at(GetParam().name);
    const std::string text = told(file.configuration_of(one));
    if (std::getenv("PANELGATE_WRITE_GOLDEN") != nullptr) {
        one.expected = text;
        std::ofstream(GetParam().file, std::ios::binary) << write_golden(file);
    }
    EXPECT_EQ(text, one.expected);
}

std::string name_of(const ::testing::TestParamInfo<Place>& info) {
    std::string name = info.param.name;
    std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
    return name;
}

INSTANTIATE_TEST_SUITE_P(Files, ConfigGolden, ::testing::ValuesIn(places()), name_of);

TEST(ConfigGoldenFolder, HoldsNothingButCasesAndEachNameOnce) {
    std::set<std::string> names;
    for (const fs::path& file : files()) {
        const std::string text = read_text(file);
        EXPECT_EQ(write_golden(parse_golden(text)), text) << file;
    }
    for (const Place& place : places()) names.insert(place.name);
    EXPECT_EQ(names.size(), places().size());
    EXPECT_GE(names.size(), 116U);
}

/// Each message has a place, and none of the parser's words.
TEST(ConfigGoldenFolder, EachCaseBeginsWithAPlace) {
    for (const fs::path& file : files()) {
        for (const GoldenCase& one : parse_golden(read_text(file)).cases) {
            if (one.expected.empty()) continue;
            EXPECT_THAT(one.expected, ::testing::ContainsRegex("^[^ :]+:[0-9]+:[0-9]+: "))
                << one.name;
            EXPECT_EQ(one.expected.find("not YAML"), std::string::npos) << one.name;
        }
    }
}

}  // namespace
}  // namespace panelgate::config::golden_test
