#include <gmock/gmock.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/profile/load_profile.hpp"

namespace panelgate::profile::shipped_test {
namespace {

using ::testing::ElementsAre;

const Catalogue& catalogue() {
    static const Catalogue shipped = Catalogue::shipped();
    return shipped;
}
const PanelProfile& shipped(std::string_view name) { return *catalogue().find(name); }

TEST(ShippedProfiles, AreTheFilesOfTheFolder) {
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(SOURCE_ROOT "/config/profiles")) {
        if (entry.path().extension() != ".yaml") continue;
        ++files;
        EXPECT_NE(catalogue().find(entry.path().stem().string()), nullptr) << entry.path();
        std::ifstream in(entry.path());
        const std::string text{std::istreambuf_iterator<char>(in), {}};
        yaml::Problems problems(entry.path().filename());
        EXPECT_TRUE(load_profile(text, "x", problems)) << problems.text();
    }
    EXPECT_EQ(files, 8u);
    EXPECT_EQ(catalogue().all().size(), 8u);
    EXPECT_EQ(catalogue().find("autonics"), nullptr);
}

TEST(ShippedProfiles, CiteASourceForEveryFigure) {
    for (const auto& [name, profile] : catalogue().all()) {
        EXPECT_FALSE(profile.manual.empty()) << name;
        EXPECT_FALSE(profile.timing.source.empty()) << name;
        for (const FunctionRule& rule : profile.functions)
            EXPECT_FALSE(rule.source.empty()) << name << " function " << unsigned{rule.code};
        for (const Area& area : profile.areas)
            EXPECT_FALSE(area.source.empty()) << name << " area " << area.name;
        EXPECT_TRUE(name == "generic" || !profile.serial.source.empty()) << name;
    }
}

struct Row {
    const char* profile;
    std::vector<int> functions;
    std::vector<int> broadcasts;
    std::vector<std::pair<std::uint8_t, unsigned>> limits;  ///< of a function
};

TEST(ShippedProfiles, HaveFunctionsBroadcastsAndLimitsOfTheManualsOrTheStandards) {
    for (const Row& row :
         {Row{"autonics-gplp-s", {1, 3, 15, 16}, {15, 16}, {{1, 2000}, {15, 1968}, {16, 123}}},
          Row{"autonics-gplp-a", {1, 3, 15, 16}, {15, 16}, {}},
          Row{"autonics-gp-2005", {3, 16}, {16}, {}},
          Row{"autonics-gp-2005-old", {3, 16}, {16}, {}},
          Row{"autonics-arm", {1, 2, 3, 4, 5, 6, 16}, {}, {{6, 1}}},
          Row{"panasonic-gt",
              {1, 3, 4, 5, 6, 15, 16},
              {5, 6, 15, 16},
              {{1, 2040}, {3, 127}, {4, 127}, {15, 2040}, {16, 127}}},
          Row{"omron-cp2e", {1, 3, 6, 15, 16}, {6, 15, 16}, {{1, 2000}, {3, 125}}},
          Row{"generic",
              {1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 15, 16, 17, 20, 21, 22, 23, 24, 43},
              {5, 6, 15, 16},
              {}}}) {
        std::vector<int> functions;
        std::vector<int> broadcasts;
        for (const FunctionRule& rule : shipped(row.profile).functions) {
            functions.push_back(rule.code);
            if (rule.broadcast) broadcasts.push_back(rule.code);
        }
        EXPECT_EQ(functions, row.functions) << row.profile;
        EXPECT_EQ(broadcasts, row.broadcasts) << row.profile;
        for (const auto& [function, limit] : row.limits)
            EXPECT_EQ(shipped(row.profile).max_count(function), limit) << row.profile;
    }
}

TEST(ShippedProfiles, HaveTheWritableRangesOfTheManuals) {
    const auto writable = [](std::string_view name, std::string_view area) {
        return shipped(name).find_area(area)->writable.value();
    };
    EXPECT_EQ(writable("autonics-gplp-s", "UW"), (AddressRange{15, 6047}));
    EXPECT_EQ(writable("autonics-gplp-s", "UB"), (AddressRange{240, 65535}));
    EXPECT_EQ(writable("autonics-gplp-a", "UW"), (AddressRange{81, 65535}));
    EXPECT_EQ(writable("autonics-gplp-a", "UB"), (AddressRange{1296, 65535}));
    EXPECT_EQ(writable("autonics-gp-2005", "UW"), (AddressRange{15, 6047}));
    EXPECT_EQ(writable("panasonic-gt", "GDT"), (AddressRange{0, 2047}));
    EXPECT_FALSE(shipped("panasonic-gt").find_area("clock")->writable);
}

TEST(ShippedProfiles, HaveTheSerialSettingsOfTheManuals) {
    for (const char* name : {"autonics-gplp-s", "autonics-gplp-a", "autonics-gp-2005"}) {
        const Serial& serial = shipped(name).serial;
        EXPECT_THAT(serial.baud, ElementsAre(38400)) << name;
        EXPECT_THAT(serial.parity, ElementsAre(Parity::none)) << name;
        EXPECT_THAT(serial.stop_bits, ElementsAre(1)) << name;
        EXPECT_EQ(to_string(serial.default_format), "38400 8N1") << name;
    }
    EXPECT_THAT(shipped("autonics-arm").serial.baud,
                ElementsAre(2400, 4800, 9600, 19200, 38400, 57600, 115200));
    EXPECT_THAT(shipped("panasonic-gt").serial.baud,
                ElementsAre(9600, 19200, 38400, 57600, 115200));
    EXPECT_THAT(shipped("panasonic-gt").serial.stop_bits, ElementsAre());
    EXPECT_THAT(shipped("omron-cp2e").serial.baud, ElementsAre());
    EXPECT_THAT(shipped("generic").serial.baud, ElementsAre());
    EXPECT_EQ(shipped("panasonic-gt").timing.frame_gap_characters, 4);
    EXPECT_EQ(shipped("panasonic-gt").timing.max_gap_bits, 24u);
}

TEST(ShippedProfiles, OldFirmwareDiffersInTheOrderOfTheCrcOnly) {
    const PanelProfile& old = shipped("autonics-gp-2005-old");
    const PanelProfile& panel = shipped("autonics-gp-2005");
    EXPECT_EQ(old.crc_order, modbus::CrcOrder::high_first);
    ASSERT_EQ(old.areas.size(), panel.areas.size());
    EXPECT_EQ(old.areas[0].readable, panel.areas[0].readable);
    EXPECT_EQ(old.areas[0].writable, panel.areas[0].writable);
    EXPECT_EQ(old.serial.default_format, panel.serial.default_format);
    for (const auto& [name, profile] : catalogue().all())
        EXPECT_TRUE(profile.crc_order == modbus::CrcOrder::low_first || name == old.name) << name;
}

TEST(Catalogue, LetsAUserReplaceAndAdd) {
    Catalogue own = Catalogue::shipped();
    PanelProfile panel = *own.find("generic");
    panel.description = "mine";
    own.add(panel);
    panel.name = "another";
    own.add(panel);
    EXPECT_EQ(own.all().size(), 9u);
    EXPECT_EQ(own.find("generic")->description, "mine");
    EXPECT_NE(own.find("another"), nullptr);
}

}  // namespace
}  // namespace panelgate::profile::shipped_test
