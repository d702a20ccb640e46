#include "tty_trouble.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace panelgate::line::open_error_test {
namespace {

TEST(OpenError, OfARefusalNamesTheGroupAndTheFlagForDocker) {
    std::string name = (std::filesystem::temp_directory_path() / "panelgate-XXXXXX").string();
    const int fd = mkstemp(name.data());
    ASSERT_GE(fd, 0);
    ASSERT_EQ(fchmod(fd, 0640), 0);
    const std::string gid = std::to_string(getegid());
    const std::string text = explain_open_error(name, EACCES);
    EXPECT_NE(text.find("Permission denied: it belongs to group "), std::string::npos) << text;
    EXPECT_NE(text.find("with mode 640, this is uid " + std::to_string(geteuid()) + " gid " + gid),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("--group-add " + gid), std::string::npos) << text;
    close(fd);
    std::filesystem::remove(name);
    EXPECT_EQ(explain_open_error(name, ENOENT), "No such file or directory");
}

}  // namespace
}  // namespace panelgate::line::open_error_test
