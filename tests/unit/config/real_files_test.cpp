#include "panelgate/config/real_files.hpp"

#include <gmock/gmock.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace panelgate::config {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;

/// An empty directory of the running test's own.
class RealFilesTest : public ::testing::Test {
  protected:
    RealFilesTest() {
        std::string name = (fs::temp_directory_path() / "panelgate-files-XXXXXX").string();
        dir_ = mkdtemp(name.data());
    }
    ~RealFilesTest() override { fs::remove_all(dir_); }

    std::string put(const std::string& name, const std::string& text) const {
        const std::string path = (dir_ / name).string();
        std::ofstream(path, std::ios::binary) << text;
        return path;
    }

    fs::path dir_;
};

TEST_F(RealFilesTest, ReadsAFileByteForByte) {
    const std::string text("a\r\n\0b", 5);
    EXPECT_EQ(RealFiles().read(put("x", text)), text);
    EXPECT_EQ(RealFiles().read(put("empty", "")), "");
}

TEST_F(RealFilesTest, SaysWhyAFileCannotBeRead) {
    EXPECT_EQ(RealFiles().read((dir_ / "absent").string()), std::nullopt);
    EXPECT_EQ(errno, ENOENT);
    EXPECT_EQ(RealFiles().read(dir_.string()), std::nullopt);
    EXPECT_EQ(errno, EISDIR);
    EXPECT_EQ(RealFiles().read("/dev/zero"), std::nullopt) << "endless";
    EXPECT_EQ(errno, EFBIG);
}

TEST_F(RealFilesTest, ListsTheYamlFilesOfADirectorySorted) {
    for (const char* name : {"b.yaml", "a.yaml", "c.yml", "README"}) put(name, "");
    EXPECT_THAT(RealFiles().list_yaml(dir_.string()).value(),
                ElementsAre((dir_ / "a.yaml").string(), (dir_ / "b.yaml").string()));
    EXPECT_EQ(RealFiles().list_yaml((dir_ / "absent").string()), std::nullopt);
}

}  // namespace
}  // namespace panelgate::config
