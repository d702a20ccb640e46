#include "starter.hpp"

#include <gmock/gmock.h>

#include <cstdint>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/profile/load_profile.hpp"
#include "unit/config/memory_files.hpp"

namespace panelgate::commands::starter_test {
namespace {

using config::load_valid;
using testing::HasSubstr;

scan::StationFinding station(std::uint8_t id, std::vector<scan::Candidate> candidates) {
    scan::StationFinding found;
    found.station = id;
    found.candidates = std::move(candidates);
    found.evidence.good = 1;
    return found;
}

/// An address that every shipped profile allows.
constexpr SerialFormat kFormat{38400, 8, Parity::none, 1};

/// One station of each shipped profile.
scan::Result everything(const profile::Catalogue& profiles) {
    scan::Result result;
    result.ending = scan::Result::Ending::finished;
    result.format = kFormat;
    std::uint8_t id = 1;
    for (const auto& [name, profile] : profiles.all()) {
        result.stations.push_back(station(id++, {{name, "it says so"}}));
        result.stations.back().crc_order = profile.crc_order;
    }
    return result;
}

std::string starter(const scan::Result& result, const std::string& device = "/dev/ttyUSB0") {
    static const profile::Catalogue kProfiles = profile::Catalogue::shipped();
    return starter_yaml({device, "", result, kProfiles});
}

TEST(Starter, OfEachProfileIsAConfigurationWithPointsThatOnlyNeedToBeUncommented) {
    const auto profiles = profile::Catalogue::shipped();
    const std::string text = starter(everything(profiles));
    const config::Config config = load_valid(text);
    ASSERT_EQ(config.lines[0].stations.size(), profiles.all().size());
    EXPECT_EQ(config.lines[0].device.device, "/dev/ttyUSB0");
    EXPECT_EQ(to_string(config.lines[0].device.serial), "38400 8N1");
    EXPECT_EQ(config.lines[0].stations[1].name, "station-2");
    for (const config::Station& one : config.lines[0].stations)
        EXPECT_TRUE(profiles.find(one.profile->name) != nullptr);
    const std::string uncommented =
        std::regex_replace(text, std::regex("\n        # (points:|  - )"), "\n        $1");
    ASSERT_NE(uncommented, text);
    const config::Config with_points = load_valid(uncommented);
    for (const config::Station& one : with_points.lines[0].stations)
        EXPECT_FALSE(one.points.empty()) << one.profile->name;
}

TEST(Starter, AClockIsNoTemperature) {
    scan::Result result;
    result.format = kFormat;
    result.stations = {station(20, {{"panasonic-gt", "a"}})};
    const std::string text = starter(result);
    EXPECT_THAT(text, HasSubstr("{name: at-gdt9080, at: \"GDT9080\", every: 1s}"));
    EXPECT_THAT(text, HasSubstr("scale: 0.1, unit: celsius"));
}

TEST(Starter, WhoAnsweredLateIsGivenMoreTime) {
    scan::Result result;
    result.format = kFormat;
    result.stations = {station(5, {{"generic", "a"}}), station(6, {{"generic", "a"}})};
    result.stations[0].evidence.late = 1;
    const config::Config config = load_valid(starter(result));
    EXPECT_EQ(config.lines[0].arbiter.stations[0].response_timeout, 2s);
    EXPECT_EQ(config.lines[0].arbiter.stations[1].response_timeout, 500ms);
}

TEST(Starter, OfARemoteLineSaysThatItsFormatIsSupposed) {
    scan::Result result;
    result.remote = true;
    result.format = kFormat;
    result.stations = {station(31, {{"autonics-gplp-s", "a"}, {"generic", "b"}})};
    const std::string text = starter(result, "tcp://10.0.0.7:4001");
    EXPECT_EQ(load_valid(text).lines[0].device.device, "tcp://10.0.0.7:4001");
    EXPECT_THAT(text, HasSubstr("supposed from the panels"));
    EXPECT_THAT(text, HasSubstr("profile: autonics-gplp-s   # or generic\n"));
    EXPECT_THAT(text, HasSubstr("# Incomplete: the scan was interrupted.\n"));
}

TEST(Starter, LeavesOutWhoseRepliesCouldNotBeRead) {
    scan::Result result;
    result.stations = {station(5, {}), station(6, {})};
    result.stations[1].evidence = {};
    const std::string text = starter(result);
    const config::Config config = load_valid(text);
    ASSERT_EQ(config.lines[0].stations.size(), 1U);
    EXPECT_EQ(config.lines[0].stations[0].profile->name, "generic");
    EXPECT_THAT(text, HasSubstr("      # - {id: 6}"));
}

TEST(Starter, TakesAnyPathAsItIs) {
    scan::Result result;
    result.stations = {station(5, {})};
    const std::string path = "/dev/a \"b\\ ${HOME}";
    EXPECT_EQ(load_valid(starter(result, path)).lines[0].device.device, path);
}

}  // namespace
}  // namespace panelgate::commands::starter_test
