#include "panelgate/profile/panel_profile.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace panelgate::profile::panel_profile_test {
namespace {

using modbus::Table;

FunctionRule rule(std::uint8_t code, unsigned max_count = 0) {
    FunctionRule made;
    made.code = code;
    made.max_count = max_count;
    return made;
}
Area area(std::string name, Table table, AddressRange readable) {
    Area made;
    made.name = std::move(name);
    made.table = table;
    made.readable = readable;
    return made;
}

TEST(AddressRange, HoldsItemsOnlyAsAWhole) {
    const AddressRange range{10, 19};
    EXPECT_TRUE(range.contains(10));
    EXPECT_TRUE(range.contains(19));
    EXPECT_TRUE(range.contains(10, 10));
    EXPECT_FALSE(range.contains(9));
    EXPECT_FALSE(range.contains(20));
    EXPECT_FALSE(range.contains(9, 2));
    EXPECT_FALSE(range.contains(10, 11));
    EXPECT_FALSE(range.contains(19, 2));
}

TEST(AddressRange, NoCountIsSoLargeThatItFits) {
    const AddressRange all{0, 65535};
    EXPECT_TRUE(all.contains(0, 65536));
    EXPECT_FALSE(all.contains(1, 65536));
    EXPECT_FALSE(all.contains(1, 0xFFFF'FFFF)) << "the sum overflows";
    EXPECT_FALSE(all.contains(0xFFFF'FFFF, 2));
}

TEST(Allows, AnEmptyListAllowsEverything) {
    EXPECT_TRUE(allows<int>({}, 9600));
    EXPECT_TRUE(allows<int>({9600, 19200}, 19200));
    EXPECT_FALSE(allows<int>({9600, 19200}, 38400));
}

TEST(PanelProfile, OneWithoutFunctionsTakesAll) {
    PanelProfile profile;
    EXPECT_TRUE(profile.has_function(3));
    EXPECT_TRUE(profile.has_function(65));
    EXPECT_EQ(profile.find_function(3), nullptr);
    profile.functions = {rule(3)};
    EXPECT_TRUE(profile.has_function(3));
    EXPECT_FALSE(profile.has_function(65));
}

TEST(PanelProfile, WhereTheManualGivesNoLimitTheStandardDoes) {
    PanelProfile profile;
    profile.functions = {rule(1), rule(3, 16), rule(16), rule(15)};
    EXPECT_EQ(profile.max_count(3), 16u);
    EXPECT_EQ(profile.max_count(1), 2000u);
    EXPECT_EQ(profile.max_count(2), 2000u) << "of one that is not listed, too";
    EXPECT_EQ(profile.max_count(4), 125u);
    EXPECT_EQ(profile.max_count(15), 1968u);
    EXPECT_EQ(profile.max_count(16), 123u);
    EXPECT_EQ(profile.max_count(5), 1u);
    EXPECT_EQ(profile.max_count(6), 1u);
}

TEST(PanelProfile, TheFirstAreaThatReachesAnItemIsItsArea) {
    PanelProfile profile;
    profile.areas = {area("clock", Table::holding_registers, {100, 109}),
                     area("D", Table::holding_registers, {0, 999}),
                     area("W", Table::coils, {0, 999})};
    profile.areas[1].also = {Table::input_registers};
    const auto found = [&](Table table, std::uint32_t address) {
        const Area* one = profile.find_area(table, address);
        return one == nullptr ? std::string("none") : one->name;
    };
    EXPECT_EQ(found(Table::holding_registers, 99), "D");
    EXPECT_EQ(found(Table::holding_registers, 100), "clock");
    EXPECT_EQ(found(Table::input_registers, 100), "D") << "the clock is not there";
    EXPECT_EQ(found(Table::coils, 100), "W");
    EXPECT_EQ(found(Table::discrete_inputs, 100), "none");
    EXPECT_EQ(found(Table::holding_registers, 1000), "none");
    EXPECT_EQ(profile.find_area("W"), &profile.areas[2]);
    EXPECT_EQ(profile.find_area("w"), nullptr);
}

}  // namespace
}  // namespace panelgate::profile::panel_profile_test
