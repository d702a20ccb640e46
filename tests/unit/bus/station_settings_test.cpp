#include "panelgate/bus/rights.hpp"

#include <gtest/gtest.h>

namespace panelgate::bus::station_settings_test {
namespace {

TEST(StationSettings, AStationIsCalledByItsNameAndAStrangerByItsId) {
    Stations stations;
    stations[17].name = "press";
    EXPECT_EQ(name_of(stations, 17), "press");
    EXPECT_EQ(name_of(stations, 18), "18");
}

TEST(StationSettings, ARuleIsToldInAStableWord) {
    EXPECT_EQ(label(Rule::read_only), "access");
    EXPECT_EQ(label(Rule::broadcast_over_read_only), "access");
    EXPECT_EQ(label(Rule::function), "function");
    EXPECT_EQ(label(Rule::quantity), "quantity");
    EXPECT_EQ(label(Rule::range), "range");
    EXPECT_EQ(label(Rule::write_protected), "read-only");
}

}  // namespace
}  // namespace panelgate::bus::station_settings_test
