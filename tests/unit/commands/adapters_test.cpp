// The adapters that scan and init offer.
#include "adapters.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace panelgate::commands::adapters_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
namespace fs = std::filesystem;

class AdaptersTest : public testing::Test {
  protected:
    AdaptersTest() { fs::create_directories(dev / "serial/by-id"); }
    ~AdaptersTest() override { fs::remove_all(dev); }
    void add(const std::string& name) const { std::ofstream(dev / name) << ""; }

    const fs::path dev =
        fs::temp_directory_path() / ("panelgate-adapters-" + std::to_string(::getpid()));
};

TEST_F(AdaptersTest, AreNamedByTheirLinksFirst) {
    for (const char* name : {"ttyUSB1", "ttyUSB0", "ttyACM0", "ttyS0", "tty"}) add(name);
    fs::create_symlink("../../ttyUSB1", dev / "serial/by-id/usb-FTDI_A1-port0");
    fs::create_symlink("../../ttyUSB9", dev / "serial/by-id/usb-gone");
    const auto list = adapters(dev);
    EXPECT_THAT(list, ElementsAre(Adapter{dev / "serial/by-id/usb-FTDI_A1-port0", "ttyUSB1"},
                                  Adapter{dev / "ttyACM0", "ttyACM0"},
                                  Adapter{dev / "ttyUSB0", "ttyUSB0"}));
    EXPECT_THAT(adapters_text(list), HasSubstr("usb-FTDI_A1-port0  (ttyUSB1)\n"));
    EXPECT_THAT(adapters_text(list), HasSubstr("/ttyACM0\n"));
}

TEST_F(AdaptersTest, AreNotThereWithoutAnyPluggedIn) {
    EXPECT_THAT(adapters(dev), IsEmpty());
    EXPECT_THAT(adapters(dev / "nowhere"), IsEmpty());
    EXPECT_THAT(adapters_text({}), HasSubstr("is it plugged in?"));
}

}  // namespace
}  // namespace panelgate::commands::adapters_test
