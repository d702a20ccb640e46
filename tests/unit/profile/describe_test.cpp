#include "panelgate/profile/describe.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>

#include "panelgate/profile/load_profile.hpp"

namespace panelgate::profile::describe_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const PanelProfile& shipped(std::string_view name) {
    static const Catalogue catalogue = Catalogue::shipped();
    return *catalogue.find(name);
}

/// Returns the text, or the error.
std::string address(std::string_view profile, std::string_view what) {
    const auto text = describe_address(shipped(profile), what);
    return text ? *text : "error: " + text.error().message;
}

TEST(DescribeAddress, TellsABitWithItsWordAndItsFunctions) {
    EXPECT_EQ(address("autonics-gplp-s", "UB00180"),
              "UB180 -> coil 288 0x0120\n"
              "  is bit 0 of UW18\n"
              "  read by function 1, written by 15\n");
    EXPECT_EQ(address("autonics-gplp-s", "UB14F"),
              "UB14F -> coil 239 0x00EF\n"
              "  is bit 15 of UW14\n"
              "  read by function 1, written by none (read only)\n");
}

TEST(DescribeAddress, TellsAWordWithItsBits) {
    EXPECT_EQ(address("autonics-gplp-s", "UW18"),
              "UW18 -> holding register 18 0x0012\n"
              "  its bits are UB180 to UB18F\n"
              "  read by function 3, written by 16\n");
    EXPECT_EQ(address("autonics-gplp-s", "UW4096"),
              "UW4096 -> holding register 4096 0x1000\n"
              "  read by function 3, written by 16\n");
}

TEST(DescribeAddress, TellsEveryTableThatReachesAnItem) {
    EXPECT_EQ(address("panasonic-gt", "GDT108"),
              "GDT108 -> holding register 108 0x006C\n"
              "  read by function 3, written by 6, 16\n"
              "  also input register 108 0x006C: read by function 4, written by none\n");
    EXPECT_EQ(address("generic", "400001"),
              "400001 -> holding register 0 0x0000\n"
              "  read by function 3, 23, written by 6, 16, 22, 23\n");
    EXPECT_EQ(address("autonics-arm", "100001"),
              "100001 -> discrete input 0 0x0000\n"
              "  read by function 2, written by none (read only)\n");
}

TEST(DescribeAddress, FindsTheNotationOfAWireAddress) {
    for (const char* what : {"coil 288", "coils/288", "coil/0x120", "coils 0X0120"})
        EXPECT_THAT(address("autonics-gplp-s", what), StartsWith("coil 288 0x0120 -> UB180\n"))
            << what;
    EXPECT_THAT(address("omron-cp2e", "coils/20"), StartsWith("coil 20 0x0014 -> W1.04\n"));
    EXPECT_THAT(address("autonics-arm", "discrete-inputs/9"),
                StartsWith("discrete input 9 0x0009 -> 100010\n"));
    EXPECT_THAT(address("autonics-arm", "holding-registers/0x404"),
                StartsWith("holding register 1028 0x0404 -> 401029\n"));
    EXPECT_THAT(address("panasonic-gt", "input register 108"),
                StartsWith("input register 108 0x006C -> GDT108\n"));
}

TEST(DescribeAddress, TellsWhatThePanelDoesNotHave) {
    EXPECT_EQ(address("autonics-gplp-s", "input-registers/0"),
              "error: autonics-gplp-s has no input register 0 0x0000");
    EXPECT_EQ(address("autonics-gplp-s", "holding register 6048"),
              "error: autonics-gplp-s has no holding register 6048 0x17A0");
    EXPECT_EQ(address("autonics-gplp-s", "coils/65536"),
              "error: '65536' is no address: 0 to 65535, or 0x0 to 0xFFFF");
    EXPECT_EQ(address("autonics-gplp-s", "coils/x"),
              "error: 'x' is no address: 0 to 65535, or 0x0 to 0xFFFF");
    EXPECT_EQ(address("autonics-gplp-s", "relays/1"),
              "error: 'relays/1' is no notation of autonics-gplp-s; its notations look like UW0, "
              "UB0");
    EXPECT_THAT(address("panasonic-gt", "WGR3"), StartsWith("error: WGR3: WGR is the word view"));
}

TEST(Describe, ShowsWhatTheManualSays) {
    const std::string text = describe(shipped("panasonic-gt"));
    EXPECT_THAT(text, StartsWith("panasonic-gt: Panasonic GT programmable display\n"
                                 "manual: Panasonic GT MODBUS (RTU mode) Slave, ARCT1F501E-5\n"
                                 "stations: 1 to 247\n"
                                 "serial: baud 9600, 19200, 38400, 57600, 115200; parity none, "
                                 "even, odd; stop bits any  [1.1.2]\n"
                                 "frame gap: 4.0 characters; a pause of 24 bit times inside a "
                                 "request loses it  [1.3, 1.2 (no response)]\n"));
    EXPECT_THAT(text, HasSubstr("  1   read coils                     up to 2040  [1.3.1]\n"));
    EXPECT_THAT(text, HasSubstr("up to 127, broadcast  [1.3.7"));
    EXPECT_THAT(text, HasSubstr("  5   write single coil              broadcast  [1.3.4]\n"));
    EXPECT_THAT(text, HasSubstr("read GDT9080 to GDT9086"));
    EXPECT_THAT(text, HasSubstr("read only, also input register  [1.1.3]\n"));
    EXPECT_THAT(text, HasSubstr("  WGR      WGR is the word view of GR"));
    EXPECT_THAT(describe(shipped("autonics-gplp-s")),
                HasSubstr("write UB150 to UB4095F, bits of UW"));
}

TEST(Describe, HasALineForEveryFunctionAndAreaOfEveryShippedProfile) {
    const Catalogue catalogue = Catalogue::shipped();
    for (const auto& [name, profile] : catalogue.all()) {
        const std::string text = describe(profile);
        // Description, manual, stations, serial, gap and the headings of functions and areas.
        const auto list = [](std::size_t entries) { return entries == 0 ? 0 : entries + 1; };
        const std::size_t lines = 7 + profile.functions.size() + profile.areas.size() +
                                  profile.unreachable.size() + list(profile.exceptions.size()) +
                                  list(profile.identification.size());
        EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), lines) << text;
    }
}

}  // namespace
}  // namespace panelgate::profile::describe_test
