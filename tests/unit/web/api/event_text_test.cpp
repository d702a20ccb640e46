#include "panelgate/web/api/events.hpp"

#include <gtest/gtest.h>

namespace panelgate::web::event_text_test {
namespace {

TEST(EventText, TellsAPointAsRestDoesAndWhoseItIs) {
    bus::StationRef station;
    station.name = "press";
    station.line = "floor1";
    points::Point point;
    point.name = "oil";
    point.unit = "bar";
    points::PointReading reading;
    EXPECT_EQ(point_event(station, point, reading),
              R"({"name":"oil","value":null,"unit":"bar","quality":"bad","age_ms":null,)"
              R"("line":"floor1","station":"press"})");
    reading.value = points::Value(std::int64_t{2});
    reading.label = "high";
    reading.quality = points::Quality::good;
    reading.age = 1'999'999ns;
    EXPECT_EQ(point_event(station, point, reading),
              R"({"name":"oil","value":2,"label":"high","unit":"bar","quality":"good",)"
              R"("age_ms":1,"line":"floor1","station":"press"})");
}

TEST(EventText, SaysWhyALineIsDownOnlyWhereThereIsAReason) {
    EXPECT_EQ(line_event("floor1", "up", ""), R"({"line":"floor1","state":"up"})");
    EXPECT_EQ(line_event("floor1", "down", "a \"quoted\" why"),
              R"({"line":"floor1","state":"down","why":"a \"quoted\" why"})");
}

TEST(EventText, NamesTheStationOfATransactionUnlessItIsABroadcast) {
    EXPECT_EQ(transaction_event("floor1", "press", 3, "ok", 1500us),
              R"({"line":"floor1","station":"press","function":3,"outcome":"ok",)"
              R"("duration_ms":1.5})");
    EXPECT_EQ(transaction_event("floor1", "", 6, "ok", 2ms),
              R"({"line":"floor1","station":null,"function":6,"outcome":"ok","duration_ms":2})");
    EXPECT_EQ(station_event("floor1", "press", "offline"),
              R"({"line":"floor1","station":"press","event":"offline"})");
}

TEST(EventText, TellsHowFarADiscoveryIs) {
    EXPECT_EQ(discovery_event("floor1", "running", 3, 242, 1),
              R"({"line":"floor1","state":"running","asked":3,"of":242,"found":1})");
}

}  // namespace
}  // namespace panelgate::web::event_text_test
