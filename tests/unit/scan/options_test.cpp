#include "panelgate/scan/options.hpp"

#include <gmock/gmock.h>

namespace panelgate::scan::options_test {
namespace {

using ::testing::ElementsAre;

TEST(ScanOptions, AreLists) {
    Settings settings;
    EXPECT_EQ(parse_baud("9600,38400,9600,31250", settings), std::nullopt);
    EXPECT_THAT(settings.baud, ElementsAre(9600, 38400, 31250));
    EXPECT_EQ(parse_parity("even,none", settings), std::nullopt);
    EXPECT_THAT(settings.parity, ElementsAre(Parity::even, Parity::none));
    EXPECT_EQ(parse_stations("5,17,20-22,21", settings), std::nullopt);
    EXPECT_THAT(settings.stations, ElementsAre(5, 17, 20, 21, 22));
    EXPECT_EQ(parse_stations("1-247", settings), std::nullopt);
    EXPECT_EQ(settings.stations.size(), 247u);
}

TEST(ScanOptions, SayWhatWouldBeRightAndLeaveTheSettingsAlone) {
    Settings settings;
    settings.stations = {9};
    for (const char* text : {"", "9600,", "fast", "49", "4000001", "9600 38400", "-9600", "9600;1"})
        EXPECT_EQ(parse_baud(text, settings),
                  std::string("--baud '") + text +
                      "' is not a list of rates from 50 to 4000000 such as 9600,38400");
    EXPECT_EQ(parse_parity("none,mark", settings),
              "--parity 'none,mark' is not a list of none, even and odd");
    for (const char* text : {"", "0", "248", "31-1", "1-", "-5", "1-31,", "a"})
        EXPECT_EQ(parse_stations(text, settings),
                  std::string("--stations '") + text +
                      "' is not a list of addresses from 1 to 247 such as 1-31 or 5,17,20-31");
    EXPECT_TRUE(settings.baud.empty());
    EXPECT_TRUE(settings.parity.empty());
    EXPECT_THAT(settings.stations, ElementsAre(9));
}

}  // namespace
}  // namespace panelgate::scan::options_test
