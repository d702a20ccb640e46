#include "panelgate/config/real_files.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <optional>
#include <string>

#include "memory_files.hpp"
#include "panelgate/config/config.hpp"
#include "support/temp_dir.hpp"

namespace panelgate::config::real_files_test {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class RealFilesTest : public ::testing::Test {
  protected:
    std::string put(const std::string& name, const std::string& text) const {
        const std::string path = at(name);
        std::ofstream(path, std::ios::binary) << text;
        return path;
    }
    std::string put_pipe() const {
        const std::string path = at("pipe");
        EXPECT_EQ(::mkfifo(path.c_str(), 0600), 0);
        return path;
    }
    std::string at(const std::string& name) const { return (dir_ / name).string(); }

    const test::TempDir folder_;
    const fs::path& dir_ = folder_.path();
};

TEST_F(RealFilesTest, ReadsAFileByteForByte) {
    const std::string text("a\r\n\0b", 5);
    EXPECT_EQ(RealFiles().read(put("x", text)), text);
    EXPECT_EQ(RealFiles().read(put("empty", "")), "");
}

TEST_F(RealFilesTest, SaysWhyAFileCannotBeRead) {
    EXPECT_EQ(RealFiles().read(at("absent")), std::nullopt);
    EXPECT_EQ(errno, ENOENT);
    EXPECT_EQ(RealFiles().read(dir_.string()), std::nullopt);
    EXPECT_EQ(errno, EISDIR);
    EXPECT_EQ(RealFiles::read_any("/dev/zero"), std::nullopt) << "endless";
    EXPECT_EQ(errno, EFBIG);
    EXPECT_EQ(RealFiles::read_any("/proc/self/mem"), std::nullopt) << "reading fails";
    EXPECT_EQ(errno, EIO);
}

TEST_F(RealFilesTest, DoesNotReadWhatMightNeverEnd) {
    const std::string pipe = put_pipe();
    for (const std::string& path : {pipe, std::string("/dev/zero")}) {
        EXPECT_TRUE(RealFiles().is_special(path)) << path;
        EXPECT_EQ(RealFiles().read(path), std::nullopt) << path;
        EXPECT_EQ(errno, EINVAL);
    }
    EXPECT_FALSE(RealFiles().is_special(put("x", "")));
    EXPECT_FALSE(RealFiles().is_special(dir_.string()));
    EXPECT_FALSE(RealFiles().is_special(at("absent")));
}

TEST_F(RealFilesTest, DoesNotWaitForeverForAPipeWriter) {
    const std::string pipe = put_pipe();
    EXPECT_EQ(RealFiles::read_any(pipe), std::nullopt);
    EXPECT_EQ(errno, EPIPE);
}

TEST_F(RealFilesTest, DoesNotWaitForeverForAPipeWriterThatIsIdle) {
    const std::string pipe = put_pipe();
    const int idle = ::open(pipe.c_str(), O_RDWR | O_CLOEXEC);
    EXPECT_EQ(::write(idle, "lines", 5), 5);
    EXPECT_EQ(RealFiles::read_any(pipe), std::nullopt);
    EXPECT_EQ(errno, ETIMEDOUT);
    ::close(idle);
}

TEST_F(RealFilesTest, ReadsWhatAnotherThreadWritesToAPipe) {
    const std::string pipe = put_pipe();
    std::future<std::optional<std::string>> read =
        std::async(std::launch::async, [&] { return RealFiles::read_any(pipe); });
    std::ofstream(pipe) << "lines: []\n";
    EXPECT_EQ(read.get(), "lines: []\n");
}

TEST_F(RealFilesTest, ReadsAnEmptyPipeWithoutAName) {
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    ::close(ends[1]);
    EXPECT_EQ(RealFiles::read_any("/dev/fd/" + std::to_string(ends[0])), "");
    ::close(ends[0]);
}

TEST_F(RealFilesTest, KnowsWhichFilesAllUsersMayRead) {
    const std::string path = put("token", "secret");
    fs::permissions(path, fs::perms(0640));
    EXPECT_FALSE(RealFiles().is_readable_by_all(path));
    fs::permissions(path, fs::perms(0644));
    EXPECT_TRUE(RealFiles().is_readable_by_all(path));
    EXPECT_FALSE(RealFiles().is_readable_by_all(at("absent")));
}

TEST_F(RealFilesTest, FollowsLinksAsFarAsTheyLead) {
    const std::string path = put("tty", "");
    fs::create_symlink("tty", at("by-id"));
    EXPECT_EQ(RealFiles().real_path(at("by-id")), RealFiles().real_path(path));
    EXPECT_EQ(RealFiles().real_path(at("absent")), at("absent"));
}

TEST_F(RealFilesTest, ListsTheYamlFilesOfADirectorySorted) {
    for (const char* name : {"b.yaml", "a.yaml", "c.yml", "README"}) put(name, "");
    EXPECT_THAT(RealFiles().list_yaml(dir_.string()).value(),
                ElementsAre(at("a.yaml"), at("b.yaml")));
    EXPECT_EQ(RealFiles().list_yaml(at("absent")), std::nullopt);
}

TEST(ConfigLoad, WarnsOfTwoNamesOfOneAdapter) {
    MemoryFiles files({});
    files.links = {{"/dev/serial/by-id/usb-a", "/dev/ttyUSB0"},
                   {"/dev/serial/by-path/1", "/dev/ttyUSB0"}};
    const Config config = load_valid(
        "lines:\n  - {name: a, device: /dev/serial/by-id/usb-a}\n"
        "  - {name: b, device: /dev/ttyUSB0}\n  - {name: c, device: /dev/ttyUSB1}\n"
        "serial_masters: [{name: plc, device: /dev/serial/by-path/1, lines: [a],\n"
        "                  units: {1: a/1}}]\n"
        "modbus_tcp: [{listen: \"127.0.0.1:502\", lines: [a]}]\n",
        files);
    EXPECT_THAT(config.warnings,
                ElementsAre("f.yaml:3:23: warning: /dev/ttyUSB0 and /dev/serial/by-id/usb-a of "
                            "line 'a' are one adapter, /dev/ttyUSB0: only one of the two can open "
                            "it; name another device",
                            HasSubstr("of line 'a' are one adapter"),
                            HasSubstr("of line 'b' are one adapter")));
}

}  // namespace
}  // namespace panelgate::config::real_files_test
