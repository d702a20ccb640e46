#include "panelgate/points/read_plan.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace panelgate::points::table_map_test {
namespace {

constexpr auto kTable = modbus::Table::holding_registers;
constexpr std::uint32_t kMost = 100;

Want want(std::uint32_t first, std::uint32_t count) {
    Want made;
    made.span = {kTable, first, count};
    return made;
}

/// A panel with 100 registers per read; each test adds readable and refused spans.
class TableMapTest : public ::testing::Test {
  protected:
    TableMapTest() { limits.of(kTable).max_items = kMost; }

    void readable(std::uint32_t first, std::uint32_t last) {
        limits.of(kTable).readable.push_back({first, last});
    }
    void refused(std::uint32_t first, std::uint32_t count, modbus::Table table = kTable) {
        limits.refused.push_back({table, first, count});
    }
    std::uint32_t reach(std::uint32_t first) const {
        return TableMap(wants, limits, kTable).reach(first);
    }

    std::vector<Want> wants;
    PlanLimits limits;
};

TEST_F(TableMapTest, AReadEndsWithWhatIsReadableOrAtThePanelsLimit) {
    readable(0, 499);
    EXPECT_EQ(reach(0), kMost);
    EXPECT_EQ(reach(400), 500u);
    EXPECT_EQ(reach(450), 500u);
    EXPECT_EQ(reach(499), 500u);
}

TEST_F(TableMapTest, WhatIsWantedMayBeReadWhateverTheProfileSays) {
    readable(0, 9);
    wants = {want(20, 5)};
    EXPECT_EQ(reach(3), 10u) << "nobody vouches for the hole";
    EXPECT_EQ(reach(20), 25u);
    wants.push_back(want(10, 10));
    EXPECT_EQ(reach(3), 25u) << "the hole is wanted: side by side is one piece";
}

TEST_F(TableMapTest, PiecesThatOverlapAreOneInAnyOrder) {
    wants = {want(30, 10), want(0, 50), want(45, 10), want(60, 1)};
    EXPECT_EQ(reach(0), 55u);
    EXPECT_EQ(reach(31), 55u);
    EXPECT_EQ(reach(60), 61u);
}

TEST_F(TableMapTest, NoReadContainsARefusedSpanWhole) {
    readable(0, 499);
    refused(20, 4);
    EXPECT_EQ(reach(0), 23u) << "all but its last";
    EXPECT_EQ(reach(20), 23u);
    EXPECT_EQ(reach(21), 121u) << "behind its first";
    refused(10, 50);
    EXPECT_EQ(reach(0), 23u) << "the least end counts, not the first beginning";
    refused(22, 1);
    EXPECT_EQ(reach(0), 22u);
    EXPECT_EQ(reach(21), 22u);
    EXPECT_EQ(reach(23), 123u);
}

TEST_F(TableMapTest, AWantThatContainsARefusedSpanIsNotReachedToItsEnd) {
    wants = {want(10, 2)};
    refused(10, 2);
    EXPECT_EQ(reach(10), 11u);
}

TEST_F(TableMapTest, OtherTablesAndEmptySpansRefuseNothing) {
    readable(0, 49);
    refused(20, 4, modbus::Table::input_registers);
    refused(20, 0);
    EXPECT_EQ(reach(0), 50u);
}

TEST_F(TableMapTest, WantsOfOtherTablesOpenNothing) {
    wants = {want(0, 10), want(10, 10)};
    wants[1].span.table = modbus::Table::coils;
    EXPECT_EQ(reach(0), 10u);
}

TEST_F(TableMapTest, TheLastItemOfTheTableEndsEveryRead) {
    wants = {want(modbus::kTableItems - 2, 2)};
    EXPECT_EQ(reach(modbus::kTableItems - 2), modbus::kTableItems);
}

TEST(IsPlannable, AWantHasItemsOfTheTableAndAnInterval) {
    EXPECT_TRUE(is_plannable(want(0, modbus::kTableItems)));
    EXPECT_TRUE(is_plannable(want(modbus::kTableItems - 1, 1)));
    EXPECT_FALSE(is_plannable(want(modbus::kTableItems - 1, 2)));
    EXPECT_FALSE(is_plannable(want(modbus::kTableItems, 1)));
    EXPECT_FALSE(is_plannable(want(1, 0xFFFF'FFFF))) << "the sum overflows";
    EXPECT_FALSE(is_plannable(want(0, 0)));
    Want never = want(0, 1);
    never.every = Duration::zero();
    EXPECT_FALSE(is_plannable(never));
}

}  // namespace
}  // namespace panelgate::points::table_map_test
