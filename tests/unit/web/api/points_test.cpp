#include <memory>
#include <utility>
#include <vector>

#include "http_rig.hpp"
#include "panelgate/points/station_polls.hpp"

namespace panelgate::web::points_test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kOil = "/api/v1/stations/press/points/oil";

/// press has a point oil (UW7, writable, 0 to 100) and a read-only point serial.
class ApiPoints : public HttpRig {
  protected:
    ApiPoints() {
        points.resize(2);
        points[0].name = "oil";
        points[0].at = "UW7";
        points[0].address = 7;
        points[0].unit = "bar";
        points[0].writable = true;
        points[0].min = 0;
        points[0].max = 100;
        points[1].name = "serial";
        points[1].at = "UW8";
        points[1].address = 8;
        polls = std::make_unique<points::StationPolls>(
            points::wants_of(points, {}), points::make_plan_limits(panel, SerialFormat{}, 2ms),
            now);
        shown = std::make_unique<points::StationPoints>(points, blocks, *polls);
        directory.stations[0].points = shown.get();
    }
    /// Each point's register holds this.
    void poll(std::uint16_t value) {
        now = std::max(now, *polls->next_due());
        for (const auto& due : polls->take_due(now)) {
            Writer reply;
            const unsigned count = polls->plan()[due.read].span.count;
            reply.u8(3).u8(2 * count);
            for (unsigned i = 0; i < count; ++i) reply.u16(value);
            polls->on_answer(now, due.read, Result<Bytes>(reply.take()), now);
        }
    }
    Reply put(const std::string& body) { return ask("PUT", kOil, body); }

    std::vector<points::Point> points;
    std::vector<points::Poll> blocks;
    std::unique_ptr<points::StationPolls> polls;
    std::unique_ptr<points::StationPoints> shown;
};

TEST_F(ApiPoints, P10ShowsNothingForWhatWasNeverRead) {
    EXPECT_EQ(get(kOil).json(),
              json_of(R"({"name":"oil","value":null,"unit":"bar","quality":"bad","age_ms":null,)"
                      R"("time":null,"at":"UW7","type":"u16","writable":true,"min":0,"max":100,)"
                      R"("step":1,"every_ms":1000})"));
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiPoints, ShowsWhatPollsHaveBroughtWithoutTouchingTheBus) {
    poll(21);
    EXPECT_EQ(get(kOil).at("value"), 21);
    EXPECT_EQ(get(kOil).at("quality"), "good");
    EXPECT_EQ(get("/api/v1/stations/press/points").at("points").as_array().size(), 2u);
    const auto all = get("/api/v1/points").at("points").as_array();
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].at("line"), "floor1");
    EXPECT_EQ(all[0].at("station"), "press");
    EXPECT_EQ(all[0].at("value"), 21);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiPoints, WritesAValueByOneRequest) {
    EXPECT_EQ(put(R"({"value":42})").json(),
              json_of(R"({"transmitted":true,"confirmed":true,"value":42})"));
    ASSERT_EQ(bus.requests.size(), 1u);
    EXPECT_EQ(last_pdu(), "06 00 07 00 2a");
    EXPECT_EQ(bus.requests[0].station, 31u);
}

TEST_F(ApiPoints, RefusesAValueThatThePointCannotTake) {
    EXPECT_EQ(put(R"({"value":101})").status(), 422u);
    EXPECT_EQ(put(R"({"value":"much"})").status(), 422u);
    EXPECT_EQ(put(R"({"value":"NaN"})").status(), 400u);
    EXPECT_EQ(put(R"({"value":null})").status(), 400u);
    EXPECT_EQ(put(R"({"values":[1]})").status(), 400u);
    EXPECT_EQ(ask("PUT", "/api/v1/stations/press/points/serial", R"({"value":1})").status(), 422u);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiPoints, WritesWhatIsExactUnlessItMayRoundAndTellsWhatWasWritten) {
    points[0].scale = 10;
    points[0].max = 25;
    points[0].labels = {{2, "low"}};
    const Reply exact = put(R"({"value":17})");
    EXPECT_EQ(exact.status(), 422u);
    EXPECT_THAT(exact.body(),
                HasSubstr("oil cannot be exactly 17 (u16, scale 10); the nearest that it can be "
                          "are 10 and 20; ?round=true writes the nearest"));
    EXPECT_EQ(ask("PUT", std::string(kOil) + "?round=yes", R"({"value":17})").status(), 400u);
    const Reply beyond = ask("PUT", std::string(kOil) + "?round=true", R"({"value":29})");
    EXPECT_EQ(beyond.status(), 422u);
    EXPECT_THAT(beyond.body(), HasSubstr("oil must be from 0 to 25, not 29"));
    EXPECT_TRUE(bus.requests.empty());
    const Reply rounded = ask("PUT", std::string(kOil) + "?round=true", R"({"value":17})");
    EXPECT_EQ(rounded.json(),
              json_of(R"({"transmitted":true,"confirmed":true,"value":20,"label":"low"})"));
    EXPECT_EQ(last_pdu(), "06 00 07 00 02");
}

TEST_F(ApiPoints, RoundsToTheNearestThatItsLimitsAllow) {
    points[0].scale = 10;
    points[0].max = 25;
    EXPECT_THAT(put(R"({"value":25})").body(), HasSubstr("is 20; ?round=true writes the nearest"));
    const Reply rounded = ask("PUT", std::string(kOil) + "?round=true", R"({"value":25})");
    EXPECT_EQ(rounded.json(), json_of(R"({"transmitted":true,"confirmed":true,"value":20})"));
}

TEST_F(ApiPoints, TakesAndTellsEveryDigit) {
    points[0].type = points::Type::u64;
    points[0].scale = 0.001;
    points[0].max.reset();
    const Reply reply = put(R"({"value":9007199254740.993})");
    EXPECT_EQ(reply.status(), 200u) << reply.body();
    EXPECT_THAT(reply.body(), HasSubstr("\"value\":9007199254740.993}"));
}

TEST_F(ApiPoints, KnowsNoOtherPoints) {
    const Reply reply = get("/api/v1/stations/press/points/water");
    EXPECT_EQ(reply.status(), 404u);
    EXPECT_THAT(reply.body(), HasSubstr("station 'press' has no point 'water'"));
    EXPECT_EQ(get("/api/v1/stations/floor1:7/points/oil").status(), 404u);
    EXPECT_EQ(get("/api/v1/stations/floor1:7/points").json(), json_of(R"({"points":[]})"));
}

TEST_F(ApiPoints, GivesAPanelsExceptionToAWrite) {
    bus.script = [](const bus::Request&) { return test::FakeBus::reply({0x86, 2}); };
    const Reply reply = put(R"({"value":42})");
    EXPECT_EQ(reply.status(), 422u);
    EXPECT_THAT(reply.body(), HasSubstr("Address is outside the range"));
}

TEST_F(ApiPoints, InterpretsAFewRegisters) {
    const Reply reply = get("/api/v1/stations/press/holding-registers/7/interpretations?count=2");
    EXPECT_EQ(reply.status(), 200u);
    EXPECT_EQ(reply.at("raw"), json_of("[7,8]"));
    EXPECT_EQ(last_pdu(), "03 00 07 00 02");
    const char* const too_many =
        "/api/v1/stations/press/holding-registers/7/interpretations?count=17";
    EXPECT_EQ(get(too_many).status(), 422u);
    EXPECT_EQ(get("/api/v1/stations/press/coils/7/interpretations").status(), 422u);
    EXPECT_EQ(bus.requests.size(), 1u);
}

TEST_F(ApiPoints, TellsWhatAValueWasReadFromToWhoeverAsks) {
    EXPECT_EQ(get(std::string(kOil) + "?raw=true").at("raw"), nullptr);
    poll(9);
    EXPECT_EQ(get(std::string(kOil) + "?raw=true").at("raw"), json_of("[9]"));
    EXPECT_EQ(get(kOil).json().count("raw"), 0u);
    EXPECT_EQ(get(std::string(kOil) + "?raw=1").at("detail"), "raw is true or false, not '1'");
}

TEST_F(ApiPoints, AreATableForSpreadsheets) {
    poll(9);
    const Reply reply =
        ask("GET", "/api/v1/stations/press/points", "", "Accept: text/csv, */*;q=0.1\r\n");
    EXPECT_EQ(reply.header("Content-Type"), "text/csv; charset=utf-8; header=present");
    EXPECT_EQ(reply.header("Vary"), "Accept");
    EXPECT_EQ(reply.body(),
              "name,value,label,unit,quality,age_ms,at,type,writable\r\n"
              "oil,9,,bar,good,0,UW7,u16,true\r\nserial,9,,,good,0,UW8,u16,false\r\n");
}

TEST_F(ApiPoints, OfManyVaryWithBothHeadersThatTheyHeed) {
    points.resize(100, points[0]);
    std::vector<points::Reading> readings(100);
    shown = std::make_unique<points::StationPoints>(points, blocks, readings);
    directory.stations[0].points = shown.get();
    const Reply reply = get("/api/v1/stations/press/points");
    EXPECT_EQ(reply.header("Vary"), "Accept, Accept-Encoding");
}

}  // namespace
}  // namespace panelgate::web::points_test
