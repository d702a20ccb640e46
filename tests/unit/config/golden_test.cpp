#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "memory_files.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config {
namespace {

namespace fs = std::filesystem;

const fs::path kFolder = fs::path(SOURCE_ROOT) / "tests/golden/config";

std::string read_file(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<fs::path> cases() {
    std::vector<fs::path> paths;
    for (const fs::directory_entry& entry : fs::directory_iterator(kFolder)) {
        if (entry.path().extension() == ".yaml") paths.push_back(entry.path());
    }
    std::ranges::sort(paths);
    return paths;
}

/// What the user reads: the problems, or the warnings of a valid file.
std::string told(const fs::path& path) {
    const MemoryFiles files({{"/run/secrets/ops", "  secret \n"},
                             {"/run/secrets/empty", " \n"},
                             {"/run/secrets/two", "one two\n"},
                             {"/etc/panelgate/profiles/broken.yaml", "descriptions: x: y\n"}});
    yaml::Problems problems(path.filename().string());
    const auto config = load(read_file(path), files, problems);
    EXPECT_EQ(config.has_value(), problems.empty());
    if (!config) return problems.text();
    std::string warnings;
    for (const std::string& warning : config->warnings) warnings += warning + '\n';
    return warnings;
}

class ConfigGolden : public ::testing::TestWithParam<fs::path> {};

/// With PANELGATE_WRITE_GOLDEN in the environment the texts are written instead: read them well.
TEST_P(ConfigGolden, SaysExactlyThis) {
    fs::path expected = GetParam();
    expected.replace_extension(".txt");
    const std::string text = told(GetParam());
    if (std::getenv("PANELGATE_WRITE_GOLDEN") != nullptr) std::ofstream(expected) << text;
    ASSERT_TRUE(fs::exists(expected)) << expected;
    EXPECT_EQ(text, read_file(expected));
}

std::string name_of(const ::testing::TestParamInfo<fs::path>& info) {
    std::string name = info.param.stem().string();
    std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
    return name;
}

INSTANTIATE_TEST_SUITE_P(Files, ConfigGolden, ::testing::ValuesIn(cases()), name_of);

TEST(ConfigGoldenFolder, HasATextForEveryFileAndNoOther) {
    std::size_t texts = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(kFolder))
        texts += entry.path().extension() == ".txt" ? 1U : 0U;
    EXPECT_EQ(texts, cases().size());
    EXPECT_GE(cases().size(), 25U);
}

}  // namespace
}  // namespace panelgate::config
