#include "station_path.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <string>
#include <utility>
#include <vector>

#include "support/fake_bus.hpp"

namespace panelgate::web::station_path_test {
namespace {

using modbus::Table;

TEST(StationPath, NamesTheFourTables) {
    EXPECT_EQ(*parse_table("coils", 404), Table::coils);
    EXPECT_EQ(*parse_table("discrete-inputs", 404), Table::discrete_inputs);
    EXPECT_EQ(*parse_table("input-registers", 404), Table::input_registers);
    EXPECT_EQ(*parse_table("holding-registers", 404), Table::holding_registers);
    const auto none = parse_table("Coils", 400);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().status, 400u);
    EXPECT_EQ(none.error().detail,
              "there is no table 'Coils'; there are coils, discrete-inputs, input-registers and "
              "holding-registers");
}

TEST(StationPath, TakesAnAddressInDecimalOrHex) {
    EXPECT_EQ(*parse_address("0"), 0u);
    EXPECT_EQ(*parse_address("065535"), 65535u);
    EXPECT_EQ(*parse_address("0x1f"), 31u);
    EXPECT_EQ(*parse_address("0XFFFF"), 65535u);
    for (const char* text : {"", "65536", "0x10000", "0x", "-1", "1f", "0x0x1", "1 "}) {
        const auto address = parse_address(text);
        ASSERT_FALSE(address) << text;
        EXPECT_EQ(address.error().detail, "'" + std::string(text) +
                                              "' is not an address: 0 to 65535, or 0x0000 to "
                                              "0xFFFF");
    }
}

/// Line floor1 with press (31; words UW to 999) and the given further stations.
class Paths : public ::testing::Test {
  protected:
    Paths() : bus(io.get_executor()) {
        panel.name = "test-panel";
        profile::Area& area = panel.areas.emplace_back();
        area.name = "UW";
        area.notation.prefix = "UW";
        area.readable = {0, 999};
        directory.generic = &generic;
        directory.lines.push_back({"floor1", "/dev/ttyUSB0", &bus, true});
        StationEntry press;
        press.name = "press";
        press.line = "floor1";
        press.id = 31;
        press.profile = &panel;
        press.bus = &bus;
        directory.stations.push_back(press);
    }
    static HttpRequest path(std::vector<std::string> arguments, std::string count = "") {
        HttpRequest request;
        request.arguments = std::move(arguments);
        if (!count.empty()) request.query.emplace("count", std::move(count));
        return request;
    }
    unsigned refusal(const Parsed<Items>& items) { return items ? 0 : items.error().status; }

    boost::asio::io_context io;
    test::FakeBus bus;
    profile::PanelProfile panel;
    profile::PanelProfile generic;
    Directory directory;
};

TEST_F(Paths, NameItemsOfATable) {
    const auto items = items_of_table_path(path({"press", "coils", "0x10"}, "3"), directory);
    ASSERT_TRUE(items);
    EXPECT_EQ(items->station.name, "press");
    EXPECT_EQ(items->span.table, Table::coils);
    EXPECT_EQ(items->span.first, 16u);
    EXPECT_EQ(items->span.count, 3u);
    EXPECT_EQ(items->area, nullptr);
}

TEST_F(Paths, FindAStationByLineAndId) {
    EXPECT_EQ(find_station(directory, "floor1:31")->name, "press");
    EXPECT_EQ(find_station(directory, "floor1:7")->name, "floor1:7");
    EXPECT_EQ(find_station(directory, "floor1:7")->profile, &generic);
    EXPECT_EQ(find_station(directory, "floor2:7").error().detail, "there is no station 'floor2:7'");
    EXPECT_EQ(find_line(directory, "floor2").error().detail, "there is no line 'floor2'");
}

TEST_F(Paths, AreWrongFromTheLeftToTheRight) {
    EXPECT_EQ(refusal(items_of_table_path(path({"x", "x", "x"}, "x"), directory)), 404u);
    EXPECT_EQ(refusal(items_of_table_path(path({"press", "x", "x"}, "x"), directory)), 404u);
    EXPECT_EQ(refusal(items_of_table_path(path({"press", "coils", "x"}, "x"), directory)), 400u);
    EXPECT_EQ(refusal(items_of_table_path(path({"press", "coils", "1"}, "x"), directory)), 400u);
}

TEST_F(Paths, EndWhereAddressesEnd) {
    EXPECT_EQ(items_of_table_path(path({"press", "coils", "65535"}, "1"), directory)->span.count,
              1u);
    const auto beyond = items_of_table_path(path({"press", "coils", "65535"}, "2"), directory);
    ASSERT_FALSE(beyond);
    EXPECT_EQ(beyond.error().detail, "count must be a whole number from 1 to 1");
}

TEST_F(Paths, NameItemsInTheVendorsNotation) {
    const auto items = items_of_device_path(path({"press", "uw100"}, "2"), directory);
    ASSERT_TRUE(items);
    EXPECT_EQ(items->area, &panel.areas[0]);
    EXPECT_EQ(items->span.table, Table::holding_registers);
    EXPECT_EQ(items->span.first, 100u);
    EXPECT_EQ(refusal(items_of_device_path(path({"press", "XY1"}), directory)), 404u);
    EXPECT_EQ(refusal(items_of_device_path(path({"press", "UW70000"}), directory)), 422u);
}

TEST_F(Paths, KnowNoNotationOfAPanelThatNobodyKnows) {
    const auto items = items_of_device_path(path({"floor1:7", "UW1"}), directory);
    ASSERT_FALSE(items);
    EXPECT_EQ(items.error().status, 422u);
    EXPECT_EQ(items.error().detail,
              "station 'floor1:7' has no profile that explains notations; read its tables");
}

}  // namespace
}  // namespace panelgate::web::station_path_test
