#include <vector>

#include "http_rig.hpp"
#include "panelgate/bus/line_history.hpp"
#include "panelgate/points/station_points.hpp"

namespace panelgate::web::history_test {
namespace {

using ::testing::HasSubstr;
namespace json = boost::json;

/// press has the points oil (a number), pump (a bit) and name (a text).
class ApiHistory : public HttpRig {
  protected:
    ApiHistory() {
        for (const char* name : {"oil", "pump", "name"}) {
            points::Point& point = configured.emplace_back();
            point.name = name;
        }
        configured[0].unit = "bar";
        configured[1].type = points::Type::boolean;
        configured[2].type = points::Type::string;
        readings.resize(3);
        points.emplace(configured, blocks, readings);
        past.emplace(configured, 1s);
        directory.stations[0].points = &*points;
        directory.stations[0].history = &*past;
        directory.lines[0].history = &line;
    }
    void record(std::size_t point, points::Quality quality, points::Value value = false) {
        points::PointReading reading;
        reading.quality = quality;
        if (quality == points::Quality::good) reading.value = std::move(value);
        past->record(now, configured[point], reading);
    }

    std::vector<points::Point> configured;
    std::vector<points::Poll> blocks;
    std::vector<points::Reading> readings;
    std::optional<points::StationPoints> points;
    std::optional<points::StationHistory> past;
    bus::LineHistory line{5s};
};

TEST_F(ApiHistory, OfAPointHasWhatItWasAndGapsWhereItWasBad) {
    record(0, points::Quality::good, points::Value(21.5));
    now += 1s;
    wall += 1s;
    record(0, points::Quality::bad);
    now += 1s;
    wall += 1s;
    record(0, points::Quality::good, points::Value(std::int64_t{0}));
    const Reply reply = get("/api/v1/stations/press/points/oil/history");
    EXPECT_EQ(reply.status(), 200u);
    EXPECT_EQ(reply.body(),
              R"({"station":"press","point":"oil","unit":"bar","every_ms":1000,"samples":[)"
              R"({"time":"2026-09-21T14:13:20.000000Z","value":21.5},)"
              R"({"time":"2026-09-21T14:13:21.000000Z","value":null},)"
              R"({"time":"2026-09-21T14:13:22.000000Z","value":0}]})"
              "\n");
}

TEST_F(ApiHistory, OfABitIsTrueAndFalse) {
    record(1, points::Quality::good, points::Value(true));
    const Reply reply = get("/api/v1/stations/press/points/pump/history");
    EXPECT_THAT(reply.body(), HasSubstr(R"("value":true)"));
}

TEST_F(ApiHistory, AsATable) {
    record(0, points::Quality::good, points::Value(21.5));
    now += 1s;
    wall += 1s;
    record(0, points::Quality::bad);
    const Reply reply =
        ask("GET", "/api/v1/stations/press/points/oil/history", "", "Accept: text/csv\r\n");
    EXPECT_EQ(reply.header("Content-Type"), "text/csv; charset=utf-8; header=present");
    EXPECT_EQ(reply.body(),
              "time,value\r\n2026-09-21T14:13:20.000000Z,21.5\r\n"
              "2026-09-21T14:13:21.000000Z,\r\n");
}

TEST_F(ApiHistory, OfALineHasItsFigures) {
    bus::LineReport report;
    report.up = true;
    report.stations.resize(1);
    line.record(now, report);
    report.wire.busy = 1250ms;
    ++report.stations[0].requests[3][Outcome::timeout];
    report.stations[0].request_duration.observe(12345us);
    line.record(now + 5s, report);
    now += 6s;
    wall += 6s;
    EXPECT_EQ(get("/api/v1/lines/floor1/history").body(),
              R"({"line":"floor1","every_ms":5000,"samples":[)"
              R"({"time":"2026-09-21T14:13:20.000000Z","load_percent":25,"requests":1,"errors":1,)"
              R"("latency_ms":12.35,"wire_ms":null,"queue_depth":0}]})"
              "\n");
    const Reply table = ask("GET", "/api/v1/lines/floor1/history", "", "Accept: text/csv\r\n");
    EXPECT_THAT(table.body(), HasSubstr("time,load_percent,requests,errors,latency_ms,wire_ms,"
                                        "queue_depth\r\n"));
    EXPECT_THAT(table.body(), HasSubstr("Z,25,1,1,12.35,,0\r\n"));
}

TEST_F(ApiHistory, ALongOneIsWhole) {
    for (int i = 0; i < 3600; ++i) {
        record(0, points::Quality::good, points::Value(std::int64_t{i}));
        now += 1s;
    }
    now -= 1s;
    const Reply reply = get("/api/v1/stations/press/points/oil/history");
    EXPECT_EQ(json::parse(reply.body()).at("samples").as_array().size(), 3600u);
}

TEST_F(ApiHistory, IsNotOfTextsAndNotOfWhatThereIsNot) {
    EXPECT_EQ(get("/api/v1/stations/press/points/name/history").status(), 404u);
    EXPECT_EQ(get("/api/v1/stations/press/points/nothing/history").status(), 404u);
    EXPECT_EQ(get("/api/v1/lines/attic/history").status(), 404u);
    EXPECT_EQ(get("/api/v1/lines/floor2/history").status(), 404u);
}

}  // namespace
}  // namespace panelgate::web::history_test
