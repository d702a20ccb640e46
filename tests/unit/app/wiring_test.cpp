#include "running_line.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cstdint>

#include <utility>
#include <vector>

#include "panelgate/profile/load_profile.hpp"
#include "support/fake_bus.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::app::wiring_test {
namespace {

/// press 31 is guarded, meter 5 is read-only; both have the profile `generic`.
class WiringTest : public testing::Test {
  protected:
    WiringTest() {
        floor.name = "floor1";
        floor.stations.resize(2);
        floor.stations[0].id = 31;
        floor.stations[0].name = "press";
        floor.stations[0].guard = true;
        floor.stations[1].id = 5;
        floor.stations[1].name = "meter";
        floor.stations[1].read_only = true;
        for (config::Station& station : floor.stations) station.profile = shipped.find("generic");
    }

    profile::Catalogue shipped = profile::Catalogue::shipped();
    config::Line floor;
};

TEST_F(WiringTest, ABusIsToldWhatMayBeDoneToItsStations) {
    const bus::Stations stations = bus_settings(floor).stations;
    ASSERT_EQ(stations.size(), 2u);
    EXPECT_EQ(stations.at(31).name, "press");
    EXPECT_EQ(stations.at(31).access, bus::Access::read_write);
    EXPECT_EQ(stations.at(5).access, bus::Access::read_only);
    EXPECT_FALSE(stations.at(5).guard);
}

TEST_F(WiringTest, WhatAPanelHasIsCountedFromTheStart) {
    floor.stations[0].profile = shipped.find("autonics-arm");
    std::vector<std::uint8_t> expected{1, 2, 3, 4, 5, 6, 15, 16};
    std::erase_if(expected, [&](std::uint8_t code) {
        return !floor.stations[0].profile->has_function(code);
    });
    const bus::Stations stations = bus_settings(floor).stations;
    EXPECT_EQ(stations.at(31).functions, expected);
    EXPECT_EQ(stations.at(5).functions.size(), 8u) << "generic: all that read and write values";
}

TEST_F(WiringTest, AGuardRefusesAsThePanelWould) {
    const bus::Guard guard = bus_settings(floor).stations.at(31).guard;
    ASSERT_TRUE(guard);
    EXPECT_FALSE(guard(test::request_of("03 0000 0001"_hex)));
    const auto function = guard(test::request_of("41"_hex));
    ASSERT_TRUE(function);
    EXPECT_EQ(function->rule, bus::Rule::function);
    EXPECT_EQ(function->why, "generic has no function 65");
    EXPECT_EQ(guard(test::request_of("05 0000 1234"_hex)).value().rule, bus::Rule::quantity)
        << "no value of a coil";
}

TEST_F(WiringTest, WhatAPanelLacksIsTranslatedUnlessTurnedOffOrGuarded) {
    const modbus::Request write = test::request_of("06 0064 0007"_hex);
    for (config::Station& station : floor.stations) {
        station.profile = shipped.find("autonics-gplp-s");
    }
    EXPECT_FALSE(bus_settings(floor).stations.at(31).translate) << "the guard refuses it";
    const bus::Translate translate = bus_settings(floor).stations.at(5).translate;
    ASSERT_TRUE(translate);
    EXPECT_EQ(translate(write).value().pdu(), "10 0064 0001 02 0007"_hex);
    const std::vector<std::pair<std::uint8_t, std::uint8_t>> both{{5, 15}, {6, 16}};
    EXPECT_EQ(bus_settings(floor).stations.at(5).translations, both) << "counted from the start";
    floor.stations[1].translate = false;
    EXPECT_FALSE(bus_settings(floor).stations.at(5).translate);
}

TEST_F(WiringTest, OnlyStationsWithPointsOrPollBlocksArePolled) {
    EXPECT_TRUE(polled_stations(floor).empty());
    floor.stations[1].polls.resize(1);
    auto polled = polled_stations(floor);
    ASSERT_EQ(polled.size(), 1u);
    EXPECT_EQ(polled[0].id, 5);
    floor.stations[0].points.resize(2);
    polled = polled_stations(floor);
    ASSERT_EQ(polled.size(), 2u);
    EXPECT_EQ(polled[0].id, 31);
    EXPECT_EQ(polled[0].wants.size(), 2u);
}

TEST_F(WiringTest, ARelayGoesFromStationToStation) {
    boost::asio::io_context io;
    test::FakeBus bus(io.get_executor());
    profile::PanelProfile single;
    single.functions.push_back({6, 0, false, ""});
    floor.stations[1].profile = &single;
    Plant plant;
    plant.add(floor, bus, nullptr);
    points::Relay relay;
    relay.from.station = "press";
    relay.to.station = "meter";
    const points::RelayRoute there = route_of(plant, relay);
    EXPECT_EQ(there.from, &bus);
    EXPECT_EQ(there.from_station, 31);
    EXPECT_EQ(there.to, &bus);
    EXPECT_EQ(there.to_station, 5);
    EXPECT_EQ(there.to_line, floor.name);
    EXPECT_TRUE(there.to_memory.shown_as) << "writes elsewhere may change it, too";
    EXPECT_FALSE(there.to_has_multiple);
    std::swap(relay.from, relay.to);
    EXPECT_TRUE(route_of(plant, relay).to_has_multiple);
}

}  // namespace
}  // namespace panelgate::app::wiring_test
