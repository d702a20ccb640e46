#include "panelgate/tcp_server/dispatch.hpp"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <stdexcept>

#include "held_bus.hpp"

namespace panelgate::tcp_server::unit_map_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class UnitMapTest : public ::testing::Test {
  protected:
    UnitMapTest() { lines = {{"floor1", &bus1, {1, 2}, true}, {"floor2", &bus2, {2, 11}, true}}; }
    UnitMap map() const { return UnitMap(settings, lines); }

    boost::asio::io_context context;
    ManualBus bus1{context};
    ManualBus bus2{context};
    std::vector<LineInfo> lines;
    Settings settings;
};

TEST_F(UnitMapTest, RoutesListedStationsToTheirLine) {
    settings.lines = {"floor1", "floor2"};
    const UnitMap units = map();
    EXPECT_EQ(units.route(1)->bus, &bus1);
    EXPECT_EQ(units.route(11)->bus, &bus2);
    EXPECT_EQ(units.route(11)->station, 11);
}

TEST_F(UnitMapTest, RoutesNoStationThatIsOnTwoLines) {
    settings.lines = {"floor1", "floor2"};
    settings.units[102] = {"floor2", 2};
    const UnitMap units = map();
    EXPECT_EQ(units.route(2).error(), Fault::not_routed);
    EXPECT_EQ(units.route(102)->bus, &bus2);
    EXPECT_EQ(units.route(102)->station, 2);
}

TEST_F(UnitMapTest, PassesUnlistedUnitsOnlyOnAListenerWithOneLine) {
    settings.lines = {"floor1", "floor2"};
    EXPECT_EQ(map().route(3).error(), Fault::not_routed);
    settings.lines = {"floor1"};
    EXPECT_EQ(map().route(3)->bus, &bus1);
    EXPECT_EQ(map().route(247)->station, 247);
    lines[0].pass_unlisted = false;
    EXPECT_EQ(map().route(3).error(), Fault::not_routed);
    EXPECT_EQ(map().route(1)->bus, &bus1);
}

TEST_F(UnitMapTest, RoutesNothingAbove247UnlessItIsAnAlias) {
    settings.lines = {"floor1"};
    settings.units[250] = {"floor2", 11};
    const UnitMap units = map();
    for (const std::uint8_t unit : Bytes{248, 249, 251, 255}) {
        EXPECT_EQ(units.route(unit).error(), Fault::not_routed) << int{unit};
    }
    EXPECT_EQ(units.route(250)->bus, &bus2) << "an alias may leave the listener's lines";
    EXPECT_TRUE(units.is_alias(250));
}

TEST_F(UnitMapTest, BroadcastsUnitZeroToEveryLineUnlessItIsMapped) {
    settings.lines = {"floor2", "floor1"};
    EXPECT_THAT(map().broadcast_lines(0), ElementsAre(&bus2, &bus1));
    EXPECT_THAT(map().broadcast_lines(1), IsEmpty());
    EXPECT_EQ(map().route(0).error(), Fault::not_routed);
    settings.units[0] = {"floor1", 1};
    EXPECT_THAT(map().broadcast_lines(0), IsEmpty());
    EXPECT_EQ(map().route(0)->station, 1);
}

TEST_F(UnitMapTest, BroadcastsAnAliasOfStationZeroToItsLine) {
    settings.lines = {"floor1", "floor2"};
    settings.units[100] = {"floor2", 0};
    EXPECT_THAT(map().broadcast_lines(100), ElementsAre(&bus2));
}

TEST_F(UnitMapTest, RefusesALineThatIsNotThere) {
    settings.lines = {"floor3"};
    EXPECT_THROW(map(), std::invalid_argument);
    settings.lines = {"floor1"};
    settings.units[9] = {"floor3", 1};
    EXPECT_THROW(map(), std::invalid_argument);
}

}  // namespace
}  // namespace panelgate::tcp_server::unit_map_test
