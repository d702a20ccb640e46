#include "station_path.hpp"

#include <gtest/gtest.h>

namespace panelgate::web::panel_limits_test {
namespace {

using modbus::Table;

class PanelLimits : public ::testing::Test {
  protected:
    PanelLimits() {
        area.name = "GDT";
        area.notation.prefix = "GDT";
        area.table = Table::input_registers;
        area.also = {Table::coils, Table::holding_registers};
        items.station.profile = &panel;
        items.span.table = area.table;
        items.area = &area;
    }
    void give_functions(std::initializer_list<std::uint8_t> codes) {
        for (const std::uint8_t code : codes) panel.functions.push_back({code, 0, false, ""});
    }
    profile::PanelProfile panel;
    profile::Area area;
    Items items;
};

TEST_F(PanelLimits, NameTheRangeThatIsLeft) {
    items.span.first = 98;
    items.span.count = 2;
    EXPECT_TRUE(check_range(items, {0, 99}, "readable"));
    items.span.count = 3;
    const auto beyond = check_range(items, {0, 99}, "readable");
    ASSERT_FALSE(beyond);
    EXPECT_EQ(beyond.error().status, 422u);
    EXPECT_EQ(beyond.error().detail,
              "3 from GDT address 98 is outside what is readable: GDT0 to GDT99");
    EXPECT_FALSE(check_range(items, {99, 200}, "readable"));
}

TEST_F(PanelLimits, ReadByTheAreasOwnTableWherePossible) {
    give_functions({3, 4});
    EXPECT_EQ(*table_to_read(items), Table::input_registers);
}

TEST_F(PanelLimits, ReadByTheFirstOtherTableWhoseFunctionThePanelHas) {
    give_functions({3, 6});
    EXPECT_EQ(*table_to_read(items), Table::holding_registers);
}

TEST_F(PanelLimits, SayThatNoFunctionReads) {
    give_functions({6});
    const auto table = table_to_read(items);
    ASSERT_FALSE(table);
    EXPECT_EQ(table.error().status, 422u);
    EXPECT_EQ(table.error().detail, "the panel has no function that reads GDT");
}

TEST_F(PanelLimits, TakeATablePathAtItsWord) {
    give_functions({6});
    items.area = nullptr;
    EXPECT_EQ(*table_to_read(items), Table::input_registers);
}

}  // namespace
}  // namespace panelgate::web::panel_limits_test
