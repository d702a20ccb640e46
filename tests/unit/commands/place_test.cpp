// What is typed behind read, write and watch.
#include "place.hpp"

#include <gmock/gmock.h>

#include <string>
#include <vector>

namespace panelgate::commands::place_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Words = std::vector<std::string>;

TEST(PlacesOf, AStationIsFollowedByItsPlaces) {
    EXPECT_THAT(places_of(Words{"press", "UW100"}).list, ElementsAre(Place{"press", "UW100"}));
    EXPECT_THAT(places_of(Words{"press", "temperature", "holding-registers/4"}).list,
                ElementsAre(Place{"press", "temperature"}, Place{"press", "holding-registers/4"}));
    EXPECT_THAT(places_of(Words{"31", "UW0"}).list, ElementsAre(Place{"31", "UW0"}));
    EXPECT_THAT(places_of(Words{"floor1/17", "coils/4"}).list,
                ElementsAre(Place{"floor1/17", "coils/4"}));
}

TEST(PlacesOf, AStationAndItsPlaceMayBeOneWord) {
    EXPECT_THAT(places_of(Words{"oven/temperature", "press/UW0"}).list,
                ElementsAre(Place{"oven", "temperature"}, Place{"press", "UW0"}));
    EXPECT_THAT(places_of(Words{"oven/coils/4", "floor1/17/coils/0x10", "floor1/17/door"}).list,
                ElementsAre(Place{"oven", "coils/4"}, Place{"floor1/17", "coils/0x10"},
                            Place{"floor1/17", "door"}));
    EXPECT_THAT(places_of(Words{"oven/mode", "press", "UW0", "oven/mode"}).list,
                ElementsAre(Place{"oven", "mode"}, Place{"press", "UW0"}, Place{"oven", "mode"}));
    EXPECT_TRUE(holds_place("oven/mode"));
    EXPECT_TRUE(holds_place("floor1/17/mode"));
    EXPECT_FALSE(holds_place("floor1/17"));
    EXPECT_FALSE(holds_place("oven"));
    EXPECT_FALSE(holds_place("coils/4"));
}

TEST(PlacesOf, SaysWhatIsMissing) {
    EXPECT_THAT(places_of(Words{"oven"}).wrong, HasSubstr("a place is missing after 'oven'"));
    EXPECT_THAT(places_of(Words{"oven/mode", "press/"}).wrong, HasSubstr("after 'press'"));
    EXPECT_THAT(places_of(Words{"coils/4"}).wrong, HasSubstr("a station is missing before"));
    EXPECT_THAT(places_of(Words{"floor1/17", "floor1/18"}).wrong, HasSubstr("after 'floor1/17'"));
    EXPECT_NE(places_of(Words{}).wrong, "");
    EXPECT_THAT(places_of(Words{"press", ""}).wrong, HasSubstr("a place is missing after 'press'"));
}

TEST(PlacesOf, SaysWhatIsWrongWithATable) {
    const std::string told =
        "there is no table 'holdings'; there are coils, discrete-inputs, input-registers, "
        "holding-registers";
    EXPECT_EQ(places_of(Words{"press", "holdings/4"}).wrong, told);
    EXPECT_EQ(places_of(Words{"31", "holdings/4"}).wrong, told);
    EXPECT_EQ(places_of(Words{"press/holdings/4"}).wrong, told);
    EXPECT_EQ(places_of(Words{"floor1/17", "coils/"}).wrong,
              "an address is missing after 'coils/', such as coils/4");
    EXPECT_EQ(places_of(Words{"press/coils/"}).wrong,
              "an address is missing after 'coils/', such as coils/4");
}

TEST(PlacesOf, BehindAPlaceTheNameOfAStationBeginsTheNext) {
    const Words stations{"press", "oven"};
    EXPECT_THAT(places_of(Words{"press", "UW0", "UW1", "oven", "GDT108"}, stations).list,
                ElementsAre(Place{"press", "UW0"}, Place{"press", "UW1"}, Place{"oven", "GDT108"}));
    EXPECT_THAT(places_of(Words{"press/UW0", "oven", "GDT108"}, stations).list,
                ElementsAre(Place{"press", "UW0"}, Place{"oven", "GDT108"}));
    EXPECT_THAT(places_of(Words{"press", "oven"}, stations).list,
                ElementsAre(Place{"press", "oven"}))
        << "its first place may have any name";
    EXPECT_THAT(places_of(Words{"press", "UW0", "oven"}, stations).wrong,
                HasSubstr("a place is missing after 'oven'"));
}

const std::vector<Station> kStations{
    {"press", "floor1", 31}, {"oven", "floor1", 20}, {"pump", "floor2", 20}};

TEST(FindStation, ByNameIdOrLineAndId) {
    EXPECT_EQ(find_station(kStations, "press").name, "press");
    EXPECT_EQ(find_station(kStations, "31").name, "press");
    EXPECT_EQ(find_station(kStations, "floor2/20").name, "pump");
    EXPECT_EQ(find_station(kStations, "floor1/9").name, "floor1:9");
    EXPECT_EQ(find_station(kStations, "floor1/254").name, "floor1:254") << "may be listed";
}

TEST(FindStation, NamesTheNearest) {
    EXPECT_EQ(find_station(kStations, "pres").wrong,
              "there is no station 'pres'; did you mean 'press'?");
    EXPECT_EQ(find_station(kStations, "furnace").wrong,
              "there is no station 'furnace'; there are press, oven, pump");
    EXPECT_EQ(find_station(kStations, "20").wrong,
              "station 20 is on several lines: floor1/20, floor2/20");
    EXPECT_THAT(find_station(kStations, "7").wrong, HasSubstr("LINE/7"));
    EXPECT_EQ(find_station(kStations, "flor1/7").wrong,
              "there is no line 'flor1'; did you mean 'floor1'?");
    EXPECT_THAT(find_station(kStations, "floor1/900").wrong, HasSubstr("1 to 255"));
}

TEST(TargetOf, PointsComeFirstAndTextIsEncoded) {
    const Words points{"temperature", "coils/4"};
    EXPECT_EQ(target_of("oven", "temperature", points).path,
              "/api/v1/stations/oven/points/temperature");
    EXPECT_EQ(target_of("oven", "temperature", points).shown, "oven/temperature");
    EXPECT_EQ(target_of("floor1:9", "coils/0x10", {}).path, "/api/v1/stations/floor1:9/coils/0x10");
    EXPECT_EQ(target_of("oven", "W0.00", points).path, "/api/v1/stations/oven/devices/W0.00");
    EXPECT_EQ(target_of("oven", "a b?/%", points).path,
              "/api/v1/stations/oven/devices/a%20b%3F%2F%25");
}

TEST(UnknownPlace, NamesThePoints) {
    const Words points{"temperature", "mode"};
    EXPECT_EQ(unknown_place("no notation", "temprature", points),
              "there is no point 'temprature'; did you mean 'temperature'?");
    EXPECT_EQ(unknown_place("no notation", "FOO", points),
              "no notation; its points are temperature, mode");
    EXPECT_EQ(unknown_place("no notation", "FOO", {}), "no notation");
}

TEST(JsonOfValue, KeepsDigitsAndKnowsWords) {
    EXPECT_EQ(json_of_value("21.50", false), "21.50");
    EXPECT_EQ(json_of_value("-5", false), "-5");
    EXPECT_EQ(json_of_value("18446744073709551615", false), "18446744073709551615");
    EXPECT_EQ(json_of_value("0x1F", false), "31");
    EXPECT_EQ(json_of_value("on", false), "true");
    EXPECT_EQ(json_of_value("false", false), "false");
    EXPECT_EQ(json_of_value("manual", false), "\"manual\"");
    EXPECT_EQ(json_of_value("12", true), "\"12\"");
    EXPECT_EQ(json_of_value("a\"b", true), "\"a\\\"b\"");
    EXPECT_EQ(json_of_value("21,5", false), "");
    EXPECT_EQ(json_of_value("21,5", true), "\"21,5\"");
    EXPECT_EQ(json_of_values(Words{"1", "on"}, false), "[1,true]");
    EXPECT_EQ(json_of_values(Words{"1"}, false), "1");
    EXPECT_EQ(json_of_values(Words{"1", "2,5"}, false), "");
}

}  // namespace
}  // namespace panelgate::commands::place_test
