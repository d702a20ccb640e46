#include "panelgate/bus/station_settings.hpp"

#include <gtest/gtest.h>

namespace panelgate::bus {
namespace {

TEST(StationSettings, AStationIsCalledByItsNameAndAStrangerByItsId) {
    Stations stations;
    stations[17].name = "press";
    EXPECT_EQ(name_of(stations, 17), "press");
    EXPECT_EQ(name_of(stations, 18), "18");
}

}  // namespace
}  // namespace panelgate::bus
