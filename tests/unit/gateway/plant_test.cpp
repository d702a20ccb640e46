// The plant: its stations and their units, what a line's bus is told of them, and simulated panels.
#include "panelgate/gateway/plant.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/gateway/running_line.hpp"
#include "panelgate/gateway/simulated_panels.hpp"
#include "panelgate/line/pty.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/tcp_server/settings.hpp"
#include "support/fake_bus.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"
#include "support/request.hpp"

namespace panelgate::gateway::plant_test {
namespace {

namespace asio = boost::asio;
using test::request_of;

config::Station station(std::uint8_t id, const char* name) {
    config::Station made;
    made.id = id;
    made.name = name;
    return made;
}

config::Line line(const char* name, std::vector<config::Station> stations) {
    config::Line made;
    made.name = name;
    made.device.device = std::string("/dev/") + name;
    made.stations = std::move(stations);
    return made;
}

/// Two lines; both have a station 5.
class PlantTest : public testing::Test {
  protected:
    PlantTest() {
        plant.add(floor1, bus1, nullptr);
        plant.add(floor2, bus2, nullptr);
    }

    asio::io_context io;
    test::FakeBus bus1{io.get_executor()};
    test::FakeBus bus2{io.get_executor()};
    config::Line floor1 = line("floor1", {station(31, "press"), station(5, "mixer")});
    config::Line floor2 = line("floor2", {station(5, "oven"), station(7, "meter")});
    test::ManualClock clock;  // for the plant's histories
    Plant plant;
};

TEST_F(PlantTest, FindsAStationByItsNameAndByLineAndId) {
    const Station* oven = plant.find("oven");
    ASSERT_NE(oven, nullptr);
    EXPECT_EQ(oven->line, "floor2");
    EXPECT_EQ(oven->id, 5);
    EXPECT_EQ(oven->bus, &bus2);
    EXPECT_EQ(oven->configured, &floor2.stations[0]);
    EXPECT_EQ(plant.find("floor2:5"), nullptr) << "that is how REST writes it";
    EXPECT_EQ(plant.find("floor1", 5)->name, "mixer");
    EXPECT_EQ(plant.find("floor2", 5), oven);
    EXPECT_EQ(plant.find("floor1", 7), nullptr);
    EXPECT_EQ(plant.find("floor3", 5), nullptr);
    EXPECT_EQ(&plant.at("floor2", 7), plant.find("meter"));
}

TEST_F(PlantTest, CallsAStationByItsNameAndAStrangerByItsId) {
    EXPECT_EQ(plant.name_of("floor1", 5), "mixer");
    EXPECT_EQ(plant.name_of("floor1", 9), "9");
    EXPECT_EQ(plant.name_of("floor1", 0), "") << "everybody";
}

TEST_F(PlantTest, AUnitIsWhatTheFirstListenerThatReachesAStationCallsIt) {
    tcp_server::Settings first;
    first.lines = {"floor1"};
    tcp_server::Settings second;
    second.lines = {"floor1", "floor2"};
    second.units = {{100, {"floor1", 31}}, {105, {"floor2", 5}}, {205, {"floor2", 5}}};
    for (const tcp_server::Settings& settings : {first, second})
        plant.add_units(tcp_server::UnitMap(settings, plant.listener_lines()));
    EXPECT_EQ(plant.find("press")->unit, 31) << "not its alias on the second listener";
    EXPECT_EQ(plant.find("mixer")->unit, 5);
    EXPECT_EQ(plant.find("oven")->unit, 105) << "the lowest";
    EXPECT_EQ(plant.find("meter")->unit, 7);
    EXPECT_EQ(plant.find_unit(105), plant.find("oven"));
    EXPECT_EQ(plant.find_unit(205), nullptr) << "an alias";
}

TEST_F(PlantTest, AStationThatNoListenerReachesHasNoUnit) {
    tcp_server::Settings both;
    both.lines = {"floor1", "floor2"};
    plant.add_units(tcp_server::UnitMap(both, plant.listener_lines()));
    EXPECT_EQ(plant.find("mixer")->unit, std::nullopt) << "5 is on two lines";
    EXPECT_EQ(plant.find("press")->unit, 31);
}

TEST_F(PlantTest, ListenersSeeItsLines) {
    floor2.refuse_unlisted = true;
    const auto lines = plant.listener_lines();
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_EQ(lines[0].name, "floor1");
    EXPECT_EQ(lines[0].bus, &bus1);
    EXPECT_EQ(lines[0].stations, (std::vector<std::uint8_t>{31, 5}));
    EXPECT_TRUE(lines[0].pass_unlisted);
    EXPECT_FALSE(lines[1].pass_unlisted);
}

TEST_F(PlantTest, ASimulatedLineHasNoDevice) {
    EXPECT_EQ(plant.lines()[0].device, "/dev/floor1");
    const auto played = std::make_shared<sim::SimulatedBus>(
        io.get_executor(), clock, sim::Settings{}, std::vector<sim::Station>{});
    const config::Line played_line = line("played", {station(1, "filler")});
    plant.add(played_line, bus1, played);
    EXPECT_EQ(plant.lines().back().device, "sim");
    EXPECT_EQ(plant.find("filler")->simulated, played);
    EXPECT_EQ(plant.find("press")->simulated, nullptr);
}

/// press 31 is guarded, meter 5 is read-only; both have the profile `generic`.
class WiringTest : public testing::Test {
  protected:
    WiringTest() {
        press.guard = true;
        meter.read_only = true;
        press.profile = meter.profile = shipped.find("generic");
    }
    bus::StationSettings told(std::uint8_t id) const {
        return explain::bus_settings(floor).stations.at(id);
    }

    profile::Catalogue shipped = profile::Catalogue::shipped();
    config::Line floor = line("floor1", {station(31, "press"), station(5, "meter")});
    config::Station& press = floor.stations[0];
    config::Station& meter = floor.stations[1];
};

TEST_F(WiringTest, ABusIsToldWhatMayBeDoneToItsStations) {
    EXPECT_EQ(explain::bus_settings(floor).stations.size(), 2u);
    EXPECT_EQ(told(31).name, "press");
    EXPECT_EQ(told(31).access, bus::Access::read_write);
    EXPECT_EQ(told(5).access, bus::Access::read_only);
    EXPECT_FALSE(told(5).guard);
}

TEST_F(WiringTest, WhatAPanelHasIsCountedFromTheStart) {
    press.profile = shipped.find("autonics-arm");
    std::vector<std::uint8_t> expected{1, 2, 3, 4, 5, 6, 15, 16};
    std::erase_if(expected, [&](std::uint8_t code) { return !press.profile->has_function(code); });
    EXPECT_EQ(told(31).functions, expected);
    EXPECT_EQ(told(5).functions.size(), 8u) << "generic: all that read and write values";
}

TEST_F(WiringTest, AGuardRefusesAsThePanelWould) {
    const bus::Guard guard = told(31).guard;
    ASSERT_TRUE(guard);
    EXPECT_FALSE(guard(request_of("03 0000 0001"_hex)));
    const auto function = guard(request_of("41"_hex));
    ASSERT_TRUE(function);
    EXPECT_EQ(function->rule, bus::Rule::function);
    EXPECT_EQ(function->why, "generic has no function 65");
    EXPECT_EQ(guard(request_of("05 0000 1234"_hex)).value().rule, bus::Rule::quantity)
        << "no value of a coil";
}

TEST_F(WiringTest, WhatAPanelLacksIsTranslatedUnlessTurnedOffOrGuarded) {
    press.profile = meter.profile = shipped.find("autonics-gplp-s");
    EXPECT_FALSE(told(31).translate) << "the guard refuses it";
    const bus::Translate translate = told(5).translate;
    ASSERT_TRUE(translate);
    EXPECT_EQ(translate(request_of("06 0064 0007"_hex)).value().pdu(), "10 0064 0001 02 0007"_hex);
    const std::vector<std::pair<std::uint8_t, std::uint8_t>> both{{5, 15}, {6, 16}};
    EXPECT_EQ(told(5).translations, both) << "counted from the start";
    meter.translate = false;
    EXPECT_FALSE(told(5).translate);
}

TEST_F(WiringTest, OnlyStationsWithPointsOrPollBlocksArePolled) {
    EXPECT_TRUE(explain::polled_stations(floor).empty());
    meter.polls.resize(1);
    auto polled = explain::polled_stations(floor);
    ASSERT_EQ(polled.size(), 1u);
    EXPECT_EQ(polled[0].id, 5);
    press.points.resize(2);
    polled = explain::polled_stations(floor);
    ASSERT_EQ(polled.size(), 2u);
    EXPECT_EQ(polled[0].id, 31);
    EXPECT_EQ(polled[0].wants.size(), 2u);
}

TEST_F(WiringTest, ARelayGoesFromStationToStation) {
    asio::io_context io;
    test::FakeBus bus(io.get_executor());
    profile::PanelProfile single;
    single.functions.push_back({6, 0, false, ""});
    meter.profile = &single;
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

class TcpBridgeTest : public testing::Test {
  protected:
    TcpBridgeTest() {
        client.connect({asio::ip::make_address("127.0.0.1"), bridge.port()});
        io.poll();
    }

    asio::io_context io{1};
    line::Pty pty;
    TcpBridge bridge{io.get_executor(), {"127.0.0.1", 0}, pty.path()};
    asio::ip::tcp::socket client{io};
    const std::array<std::uint8_t, 1024> bytes{};
};

TEST_F(TcpBridgeTest, AClientThatDoesNotReadLosesBytesInsteadOfHoldingTheLoop) {
    constexpr std::size_t kMoreThanSocketsHold = 32 * 1024 * 1024;
    std::size_t taken = 0;
    while (taken < kMoreThanSocketsHold) {
        const ssize_t n = ::write(pty.master(), bytes.data(), bytes.size());
        if (n > 0) taken += static_cast<std::size_t>(n);
        io.poll();
    }
    EXPECT_GE(taken, kMoreThanSocketsHold);
}

TEST_F(TcpBridgeTest, WhatNobodyTakesFromTheLineIsLost) {
    client.non_blocking(true);
    constexpr std::size_t kMoreThanAPtyHolds = 1024 * 1024;
    std::size_t sent = 0;
    while (sent < kMoreThanAPtyHolds) {
        boost::system::error_code full;
        sent += client.send(asio::buffer(bytes), 0, full);
        io.poll();
    }
    EXPECT_GE(sent, kMoreThanAPtyHolds);
}

}  // namespace
}  // namespace panelgate::gateway::plant_test
