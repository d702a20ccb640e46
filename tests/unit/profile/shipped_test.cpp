#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "panelgate/profile/load_profile.hpp"

namespace panelgate::profile::shipped_test {
namespace {

using ::testing::ElementsAre;

const Catalogue& catalogue() {
    static const Catalogue shipped = Catalogue::shipped();
    return shipped;
}

std::vector<int> functions_of(std::string_view name) {
    std::vector<int> codes;
    for (const FunctionRule& rule : catalogue().find(name)->functions) codes.push_back(rule.code);
    return codes;
}
std::vector<int> broadcasts_of(std::string_view name) {
    std::vector<int> codes;
    for (const FunctionRule& rule : catalogue().find(name)->functions)
        if (rule.broadcast) codes.push_back(rule.code);
    return codes;
}

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

TEST(ShippedProfiles, OldFirmwareDiffersInTheOrderOfTheCrcOnly) {
    const PanelProfile& old = *catalogue().find("autonics-gp-2005-old");
    const PanelProfile& panel = *catalogue().find("autonics-gp-2005");
    EXPECT_EQ(old.crc_order, modbus::CrcOrder::high_first);
    EXPECT_EQ(functions_of(old.name), functions_of(panel.name));
    EXPECT_EQ(broadcasts_of(old.name), broadcasts_of(panel.name));
    ASSERT_EQ(old.areas.size(), panel.areas.size());
    EXPECT_EQ(old.areas[0].readable.last, panel.areas[0].readable.last);
    EXPECT_EQ(old.areas[0].writable->first, panel.areas[0].writable->first);
    EXPECT_EQ(old.serial.default_format, panel.serial.default_format);
    for (const auto& [name, profile] : catalogue().all())
        EXPECT_TRUE(profile.crc_order == modbus::CrcOrder::low_first || name == old.name) << name;
}

TEST(ShippedProfiles, CiteASourceForEveryFigure) {
    for (const auto& [name, profile] : catalogue().all()) {
        EXPECT_FALSE(profile.manual.empty()) << name;
        EXPECT_FALSE(profile.timing.source.empty()) << name;
        for (const FunctionRule& rule : profile.functions)
            EXPECT_FALSE(rule.source.empty()) << name << " function " << unsigned{rule.code};
        for (const Area& area : profile.areas)
            EXPECT_FALSE(area.source.empty()) << name << " area " << area.name;
        if (name != "generic") {
            EXPECT_FALSE(profile.serial.source.empty()) << name;
        }
    }
}

TEST(ShippedProfiles, HaveTheFunctionsOfTheManuals) {
    EXPECT_THAT(functions_of("autonics-gplp-s"), ElementsAre(1, 3, 15, 16));
    EXPECT_THAT(functions_of("autonics-gplp-a"), ElementsAre(1, 3, 15, 16));
    EXPECT_THAT(functions_of("autonics-gp-2005"), ElementsAre(3, 16));
    EXPECT_THAT(functions_of("autonics-arm"), ElementsAre(1, 2, 3, 4, 5, 6, 16));
    EXPECT_THAT(functions_of("panasonic-gt"), ElementsAre(1, 3, 4, 5, 6, 15, 16));
    EXPECT_THAT(functions_of("omron-cp2e"), ElementsAre(1, 3, 6, 15, 16));
    EXPECT_THAT(functions_of("generic"),
                ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 15, 16, 17, 20, 21, 22, 23, 24, 43));
}

TEST(ShippedProfiles, HaveTheBroadcastsOfTheManuals) {
    EXPECT_THAT(broadcasts_of("autonics-gplp-s"), ElementsAre(15, 16));
    EXPECT_THAT(broadcasts_of("autonics-gp-2005"), ElementsAre(16));
    EXPECT_THAT(broadcasts_of("autonics-arm"), ElementsAre());
    EXPECT_THAT(broadcasts_of("panasonic-gt"), ElementsAre(5, 6, 15, 16));
    EXPECT_THAT(broadcasts_of("omron-cp2e"), ElementsAre(6, 15, 16));
}

TEST(ShippedProfiles, HaveTheLimitsOfTheManualsOrTheStandards) {
    const auto limit = [](std::string_view name, std::uint8_t function) {
        return catalogue().find(name)->max_count(function);
    };
    EXPECT_EQ(limit("panasonic-gt", 1), 2040u);
    EXPECT_EQ(limit("panasonic-gt", 3), 127u);
    EXPECT_EQ(limit("panasonic-gt", 4), 127u);
    EXPECT_EQ(limit("panasonic-gt", 15), 2040u);
    EXPECT_EQ(limit("panasonic-gt", 16), 127u);
    EXPECT_EQ(limit("omron-cp2e", 1), 2000u);
    EXPECT_EQ(limit("omron-cp2e", 3), 125u);
    EXPECT_EQ(limit("autonics-gplp-s", 1), 2000u);
    EXPECT_EQ(limit("autonics-gplp-s", 15), 1968u);
    EXPECT_EQ(limit("autonics-gplp-s", 16), 123u);
    EXPECT_EQ(limit("autonics-arm", 6), 1u);
}

TEST(ShippedProfiles, HaveTheWritableRangesOfTheManuals) {
    const auto writable = [](std::string_view name, std::string_view area) {
        const AddressRange range = catalogue().find(name)->find_area(area)->writable.value();
        return std::pair(range.first, range.last);
    };
    EXPECT_EQ(writable("autonics-gplp-s", "UW"), std::pair(15u, 6047u));
    EXPECT_EQ(writable("autonics-gplp-s", "UB"), std::pair(240u, 65535u));
    EXPECT_EQ(writable("autonics-gplp-a", "UW"), std::pair(81u, 65535u));
    EXPECT_EQ(writable("autonics-gplp-a", "UB"), std::pair(1296u, 65535u));
    EXPECT_EQ(writable("autonics-gp-2005", "UW"), std::pair(15u, 6047u));
    EXPECT_EQ(writable("panasonic-gt", "GDT"), std::pair(0u, 2047u));
    EXPECT_FALSE(catalogue().find("panasonic-gt")->find_area("clock")->writable);
}

TEST(ShippedProfiles, HaveTheSerialSettingsOfTheManuals) {
    for (const char* name : {"autonics-gplp-s", "autonics-gplp-a", "autonics-gp-2005"}) {
        const Serial& serial = catalogue().find(name)->serial;
        EXPECT_THAT(serial.baud, ElementsAre(38400)) << name;
        EXPECT_THAT(serial.parity, ElementsAre(Parity::none)) << name;
        EXPECT_THAT(serial.stop_bits, ElementsAre(1)) << name;
        EXPECT_EQ(to_string(serial.default_format), "38400 8N1") << name;
    }
    EXPECT_THAT(catalogue().find("autonics-arm")->serial.baud,
                ElementsAre(2400, 4800, 9600, 19200, 38400, 57600, 115200));
    EXPECT_THAT(catalogue().find("panasonic-gt")->serial.baud,
                ElementsAre(9600, 19200, 38400, 57600, 115200));
    EXPECT_THAT(catalogue().find("panasonic-gt")->serial.stop_bits, ElementsAre());
    EXPECT_THAT(catalogue().find("omron-cp2e")->serial.baud, ElementsAre());
    EXPECT_THAT(catalogue().find("generic")->serial.baud, ElementsAre());
    EXPECT_EQ(catalogue().find("panasonic-gt")->timing.frame_gap_characters, 4);
    EXPECT_EQ(catalogue().find("panasonic-gt")->timing.max_gap_bits, 24u);
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
