#include "plant.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>

#include "panelgate/tcp_server/settings.hpp"
#include "support/fake_bus.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::app::plant_test {
namespace {

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

    boost::asio::io_context io;
    test::FakeBus bus1{io.get_executor()};
    test::FakeBus bus2{io.get_executor()};
    config::Line floor1 = line("floor1", {station(31, "press"), station(5, "mixer")});
    config::Line floor2 = line("floor2", {station(5, "oven"), station(7, "meter")});
    test::ManualClock clock;  // for the plant's histories
    Plant plant;
};

TEST_F(PlantTest, FindsAStationByItsName) {
    const Station* oven = plant.find("oven");
    ASSERT_NE(oven, nullptr);
    EXPECT_EQ(oven->line, "floor2");
    EXPECT_EQ(oven->id, 5);
    EXPECT_EQ(oven->bus, &bus2);
    EXPECT_EQ(oven->configured, &floor2.stations[0]);
    EXPECT_EQ(plant.find("floor2:5"), nullptr) << "that is how REST writes it";
}

TEST_F(PlantTest, FindsAStationByLineAndId) {
    EXPECT_EQ(plant.find("floor1", 5)->name, "mixer");
    EXPECT_EQ(plant.find("floor2", 5)->name, "oven");
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

}  // namespace
}  // namespace panelgate::app::plant_test
