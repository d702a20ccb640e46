// Which process is reached where a gateway listens.
#include "local_gateway.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "support/temp_dir.hpp"

namespace panelgate::commands::local_gateway_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// As little-endian machines print it; 1F90 is 8080.
constexpr const char* kTcp =
    "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout "
    "inode\n"
    "   0: 0100007F:1F90 00000000:0000 0A 00000000:00000000 00:00000000 00000000     0        0 11 "
    "1 0\n"
    "   1: 0100007F:1F90 0100007F:A1B2 01 00000000:00000000 00:00000000 00000000     0        0 12 "
    "1 0\n"
    "   2: 0100007F:1F91 00000000:0000 0A 00000000:00000000 00:00000000 00000000     0        0 13 "
    "1 0\n"
    "   3: 00000000:1F90 00000000:0000 0A 00000000:00000000 00:00000000 00000000     0        0 14 "
    "1 0\n"
    "   4: 0900000A:1F90 00000000:0000 0A 00000000:00000000 00:00000000 00000000     0        0 15 "
    "1 0\n"
    "   5: nonsense\n";
constexpr const char* kTcp6 =
    "   0: 00000000000000000000000000000000:1F90 00000000000000000000000000000000:0000 0A "
    "00000000:00000000 00:00000000 00000000     0        0 21 1 0\n"
    "   1: 00000000000000000000000001000000:1F90 00000000000000000000000000000000:0000 0A "
    "00000000:00000000 00:00000000 00000000     0        0 22 1 0\n";

TEST(LocalGateway, SocketsThatListenOnLoopbackOrEverywhereAreReachedOnLoopback) {
    EXPECT_THAT(listening_inodes(kTcp, {"127.0.0.1", 8080}), ElementsAre("11", "14"));
    EXPECT_THAT(listening_inodes(kTcp6, {"127.0.0.1", 8080}), ElementsAre("21"));
    EXPECT_THAT(listening_inodes(kTcp6, {"::1", 8080}), ElementsAre("21", "22"));
    EXPECT_THAT(listening_inodes(kTcp, {"127.0.0.1", 80}), IsEmpty());
}

TEST(LocalGateway, AnotherAddressIsOursOnlyIfASocketListensAtItAlone) {
    EXPECT_THAT(listening_inodes(kTcp, {"10.0.0.9", 8080}), ElementsAre("15"));
    EXPECT_THAT(listening_inodes(kTcp, {"10.0.0.8", 8080}), IsEmpty());
    EXPECT_THAT(listening_inodes(kTcp, {"gateway.plant.example", 8080}), IsEmpty());
}

/// A procfs with one process that holds the socket 11.
class Procfs : public testing::Test {
  protected:
    Procfs() {
        std::filesystem::create_directories(proc / "net");
        std::ofstream(proc / "net/tcp") << kTcp;
    }
    void add(const std::string& pid, const std::string& name, const std::string& inode) const {
        std::filesystem::create_directories(proc / pid / "fd");
        std::ofstream(proc / pid / "comm") << name << '\n';
        std::filesystem::create_symlink("socket:[" + inode + "]", proc / pid / "fd/7");
    }

    test::TempDir folder;
    std::filesystem::path proc{folder.path()};
};

TEST_F(Procfs, TheProcessThatHoldsTheSocketIsFound) {
    add("100", "panelgate", "13");
    add("200", "panelgate", "11");
    add("self", "panelgate", "11");
    EXPECT_EQ(process_at({"127.0.0.1", 8080}, proc), 200);
}

TEST_F(Procfs, AnotherProgramIsNone) {
    add("100", "nginx", "11");
    EXPECT_EQ(process_at({"127.0.0.1", 8080}, proc), std::nullopt);
    EXPECT_EQ(process_at({"127.0.0.1", 8080}, proc / "nowhere"), std::nullopt);
}

}  // namespace
}  // namespace panelgate::commands::local_gateway_test
