#include "writing.hpp"

#include <gmock/gmock.h>

#include <string>

namespace panelgate::web::write_plan_test {
namespace {

using modbus::Table;
using ::testing::ElementsAre;
using Cells = std::vector<std::uint16_t>;

/// Items of a panel with these functions; 16 takes four registers at once.
class WritePlan : public ::testing::Test {
  protected:
    Items items(Table table, std::uint16_t address, std::initializer_list<int> functions) {
        panel.functions.clear();
        for (const int code : functions) {
            const unsigned limit = code == 16 ? 4 : 0;
            panel.functions.push_back({static_cast<std::uint8_t>(code), limit, false, ""});
        }
        Items made;
        made.station.name = "press";
        made.station.profile = &panel;
        made.span.table = table;
        made.span.first = address;
        return made;
    }
    static std::string pdu(const Items& items, const Cells& cells) {
        const auto planned = plan_write(items, cells);
        return planned ? to_hex(*planned) : planned.error().detail;
    }
    profile::PanelProfile panel;
};

TEST_F(WritePlan, WritesOneByTheSingleFunctionAndSeveralByTheMultipleOne) {
    const Items registers = items(Table::holding_registers, 0x10, {6, 16});
    EXPECT_EQ(pdu(registers, {5}), "06 00 10 00 05");
    EXPECT_EQ(pdu(registers, {5, 6}), "10 00 10 00 02 04 00 05 00 06");
    const Items bits = items(Table::coils, 0x10, {5, 15});
    EXPECT_EQ(pdu(bits, {1}), "05 00 10 ff 00");
    EXPECT_EQ(pdu(bits, {0}), "05 00 10 00 00");
    EXPECT_EQ(pdu(bits, {1, 0, 1}), "0f 00 10 00 03 01 05");
}

TEST_F(WritePlan, WritesOneByTheMultipleFunctionWhereThereIsNoOther) {
    EXPECT_EQ(pdu(items(Table::holding_registers, 0, {3, 16}), {5}), "10 00 00 00 01 02 00 05");
}

TEST_F(WritePlan, KeepsToTheStandardWhereTheProfileSaysNothing) {
    Items unknown = items(Table::holding_registers, 0, {});
    EXPECT_EQ(pdu(unknown, {5}), "06 00 00 00 05");
    EXPECT_EQ(pdu(unknown, Cells(123)).substr(0, 14), "10 00 00 00 7b");
    EXPECT_EQ(pdu(unknown, Cells(124)), "at most 123 values in one write; writes are not split");
}

TEST_F(WritePlan, NamesTheFunctionThatThePanelLacks) {
    EXPECT_EQ(pdu(items(Table::coils, 0, {1, 6, 16}), {1}),
              "the panel has no function 0F for 1 of its coils");
    EXPECT_EQ(pdu(items(Table::holding_registers, 0, {6}), {1, 2}),
              "the panel has no function 10 for 2 of its holding-registers");
}

TEST_F(WritePlan, NeverSplits) {
    const Items registers = items(Table::holding_registers, 0, {6, 16});
    EXPECT_EQ(pdu(registers, Cells(5)), "at most 4 values in one write; writes are not split");
}

TEST_F(WritePlan, EndsWhereAddressesEnd) {
    const Items last = items(Table::holding_registers, 0xFFFF, {6, 16});
    EXPECT_EQ(pdu(last, {5}), "06 ff ff 00 05");
    EXPECT_EQ(pdu(last, {5, 6}), "these values go beyond address 65535");
}

TEST_F(WritePlan, KeepsToTheWritableRangeOfANotation) {
    Items items_of_area = items(Table::holding_registers, 498, {6, 16});
    profile::Area area;
    area.name = "UW";
    area.notation.prefix = "UW";
    area.readable = {0, 999};
    area.writable = profile::AddressRange{0, 499};
    items_of_area.area = &area;
    EXPECT_EQ(pdu(items_of_area, {1, 2}), "10 01 f2 00 02 04 00 01 00 02");
    EXPECT_EQ(pdu(items_of_area, {1, 2, 3}),
              "3 from UW address 498 is outside what is writable: UW0 to UW499");
}

TEST(WriteFunctions, AreThePreferredOneFirst) {
    EXPECT_THAT(write_functions(Table::coils, 1), ElementsAre(5, 15));
    EXPECT_THAT(write_functions(Table::coils, 2), ElementsAre(15));
    EXPECT_THAT(write_functions(Table::holding_registers, 1), ElementsAre(6, 16));
    EXPECT_THAT(write_functions(Table::holding_registers, 2), ElementsAre(16));
}

}  // namespace
}  // namespace panelgate::web::write_plan_test
