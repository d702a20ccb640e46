// Points of a station: their values, writes of them and their history.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "http_rig.hpp"
#include "panelgate/bus/line_history.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/points/station_polls.hpp"

namespace panelgate::web::points_test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kOil = "/api/v1/stations/press/points/oil";
constexpr const char* kOilHistory = "/api/v1/stations/press/points/oil/history";
constexpr const char* kCsv = "Accept: text/csv, */*;q=0.1\r\n";

/// press has a point oil (UW7, writable, 0 to 100) and a read-only point serial.
class ApiPoints : public HttpRig {
  protected:
    ApiPoints() : points{oil_point(), {}} {
        points[0].min = 0;
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
        while (const auto due = polls->take_due(now)) {
            Writer reply;
            const unsigned count = polls->plan()[due->read].span.count;
            reply.u8(3).u8(2 * count);
            for (unsigned i = 0; i < count; ++i) reply.u16(value);
            polls->on_answer(now, due->read, Result<Bytes>(reply.take()), now);
        }
    }
    Reply put(const std::string& body, const char* query = "") {
        return ask("PUT", std::string(kOil) + query, body);
    }
    /// Somebody writes oil; it has not been polled since.
    void is_written() {
        now += 1ms;
        polls->on_write(now, modbus::Span{modbus::Table::holding_registers, 7, 1});
    }

    std::vector<points::Point> points;
    std::vector<points::Poll> blocks;
    std::unique_ptr<points::StationPolls> polls;
    std::unique_ptr<points::StationPoints> shown;
};

TEST_F(ApiPoints, PlanIsTheFrameThatWouldReadItOrWriteAValue) {
    const auto frame = [&](const std::string& query) {
        return std::string(get(std::string(kOil) + "/plan" + query).at("frame").as_string());
    };
    EXPECT_THAT(frame(""), HasSubstr("1F 03 00 07 00 01"));
    EXPECT_THAT(frame("?value=42"), HasSubstr("1F 06 00 07 00 2A"));
    expect_gets("/api/v1/stations/press/points/", 422,
                {"oil/plan?value=101", "oil/plan?value=true", "serial/plan?value=1"});
    expect_gets("/api/v1/stations/press/points/", 400, {"oil/plan?value=1,250"});
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiPoints, P10ShowsNothingForWhatWasNeverRead) {
    EXPECT_EQ(get(kOil).json(),
              json_of(R"({"name":"oil","value":null,"unit":"bar","quality":"bad","age_ms":null,)"
                      R"("time":null,"at":"UW7","type":"u16","writable":true,"min":0,"max":100,)"
                      R"("step":1,"every_ms":1000})"));
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiPoints, ShowsWhatPollsHaveBroughtWithoutTouchingTheBus) {
    poll(21);
    EXPECT_EQ(status_and(get(kOil), "value quality"), "200 21 good");
    EXPECT_EQ(get("/api/v1/stations/press/points").at("points").as_array().size(), 2u);
    const auto all = get("/api/v1/points").at("points").as_array();
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].at("line"), "floor1");
    EXPECT_EQ(all[0].at("station"), "press");
    EXPECT_EQ(all[0].at("value"), 21);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiPoints, P6BehindAWriteIsWhatThePanelHasNow) {
    poll(21);
    is_written();
    const Reply reply = get(std::string(kOil) + "?raw=true");
    EXPECT_EQ(status_and(reply, "value raw quality age_ms"), "200 7 [7] good 0");
    EXPECT_NE(reply.header("ETag"), "");
    ASSERT_EQ(bus.requests.size(), 1u);
    EXPECT_EQ(last_pdu(), "03 00 07 00 01");
    EXPECT_EQ(get("/api/v1/stations/press/points/serial").at("value"), 21);
    EXPECT_EQ(bus.requests.size(), 1u) << "nobody has written it";
    now += 1s;
    poll(8);
    EXPECT_EQ(get(kOil).at("value"), 8);
    EXPECT_EQ(bus.requests.size(), 1u) << "it was polled since";
}

TEST_F(ApiPoints, P10WhatCannotBeReadBehindAWriteIsStale) {
    poll(21);
    is_written();
    answer_with(Fault::timeout, true);
    EXPECT_EQ(status_and(get(kOil), "value quality"), "200 21 stale");
    EXPECT_EQ(bus.requests.size(), 1u);
}

TEST_F(ApiPoints, NobodyIsAskedBehindAWriteByAListOrWhereAnotherMasterAsks) {
    poll(21);
    is_written();
    const auto all = get("/api/v1/points").at("points").as_array();
    EXPECT_EQ(all.at(0).at("quality"), "stale");
    EXPECT_TRUE(bus.requests.empty());
    bus.line.listens = true;
    EXPECT_EQ(get(kOil).at("quality"), "stale");
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiPoints, WritesAValueByOneRequest) {
    EXPECT_EQ(put(R"({"value":42})").json(),
              json_of(R"({"transmitted":true,"confirmed":true,"value":42})"));
    ASSERT_EQ(bus.requests.size(), 1u);
    EXPECT_EQ(last_pdu(), "06 00 07 00 2a");
    EXPECT_EQ(bus.requests[0].station, 31u);
    answer_with({0x86, 2});
    EXPECT_EQ(status_and(put(R"({"value":42})"), "modbus_exception"), "422 2");
}

TEST_F(ApiPoints, RefusesAValueThatThePointCannotTake) {
    expect_bodies("PUT", kOil, 422, {R"({"value":101})", R"({"value":"much"})"});
    expect_bodies("PUT", kOil, 400,
                  {R"({"value":"NaN"})", R"({"value":null})", R"({"values":[1]})"});
    expect_bodies("PUT", "/api/v1/stations/press/points/serial", 422, {R"({"value":1})"});
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
    EXPECT_THAT(put(R"({"value":25})").body(), HasSubstr("is 20; ?round=true writes the nearest"));
    EXPECT_EQ(put(R"({"value":17})", "?round=yes").status(), 400u);
    const Reply beyond = put(R"({"value":29})", "?round=true");
    EXPECT_EQ(beyond.status(), 422u);
    EXPECT_THAT(beyond.body(), HasSubstr("oil must be from 0 to 25, not 29"));
    EXPECT_TRUE(bus.requests.empty());
    for (const char* body : {R"({"value":17})", R"({"value":25})"}) {
        EXPECT_EQ(put(body, "?round=true").json(),
                  json_of(R"({"transmitted":true,"confirmed":true,"value":20,"label":"low"})"))
            << "the nearest that its limits allow";
        EXPECT_EQ(last_pdu(), "06 00 07 00 02");
    }
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
    expect_gets("/api/v1/stations/",
                {{"press/points/water", 404, "station 'press' has no point 'water'"},
                 {"floor1:7/points/oil", 404}});
    EXPECT_EQ(get("/api/v1/stations/floor1:7/points").json(), json_of(R"({"points":[]})"));
}

TEST_F(ApiPoints, InterpretsAFewRegisters) {
    const Reply reply = get("/api/v1/stations/press/holding-registers/7/interpretations?count=2");
    EXPECT_EQ(status_and(reply, "raw"), "200 [7,8]");
    EXPECT_EQ(last_pdu(), "03 00 07 00 02");
    expect_gets("/api/v1/stations/press/", 422,
                {"holding-registers/7/interpretations?count=17", "coils/7/interpretations"});
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
    const Reply reply = ask("GET", "/api/v1/stations/press/points", "", kCsv);
    EXPECT_EQ(reply.header("Content-Type"), "text/csv; charset=utf-8; header=present");
    EXPECT_EQ(reply.header("Vary"), "Accept");
    EXPECT_EQ(reply.body(),
              "name,value,label,unit,quality,age_ms,at,type,writable,bit,length,word_order,scale,"
              "offset,min,max,labels,no_value,every,report,overview\r\n"
              "oil,9,,bar,good,0,UW7,u16,true,,,,,,0,100,,,1000ms,,\r\n"
              "serial,9,,,good,0,UW8,u16,false,,,,,,,,,,1000ms,,\r\n");
}

TEST_F(ApiPoints, OfManyVaryWithBothHeadersThatTheyHeed) {
    points.resize(100, points[0]);
    std::vector<points::Reading> readings(100);
    shown = std::make_unique<points::StationPoints>(points, blocks, readings);
    directory.stations[0].points = shown.get();
    const Reply reply = get("/api/v1/stations/press/points");
    EXPECT_EQ(reply.header("Vary"), "Accept, Accept-Encoding");
}

/// press has the points oil (a number), pump (a bit) and name (a text).
class ApiHistory : public HttpRig {
  protected:
    ApiHistory() {
        directory.stations[0].points = &points;
        directory.stations[0].history = &past;
        directory.lines[0].history = &line;
    }
    static std::vector<points::Point> three_points() {
        std::vector<points::Point> all{oil_point(), {}, {}};
        all[1].name = "pump";
        all[1].type = points::Type::boolean;
        all[2].name = "name";
        all[2].type = points::Type::string;
        return all;
    }
    /// A value of a point, or (nothing) that it is bad.
    void record(std::size_t point, std::optional<points::Value> value) {
        points::PointReading reading;
        reading.quality = value ? points::Quality::good : points::Quality::bad;
        reading.value = std::move(value);
        past.record(now, configured[point], reading);
    }
    void wait(std::chrono::seconds time) {
        now += time;
        wall += time;
    }

    std::vector<points::Point> configured = three_points();
    std::vector<points::Poll> blocks;
    std::vector<points::Reading> readings = std::vector<points::Reading>(3);
    points::StationPoints points{configured, blocks, readings};
    points::StationHistory past{configured, 1s};
    bus::LineHistory line{5s};
};

TEST_F(ApiHistory, OfAPointHasWhatItWasAndGapsWhereItWasBad) {
    record(0, 21.5);
    wait(1s);
    record(0, {});
    wait(1s);
    record(0, std::int64_t{0});
    const Reply reply = get(kOilHistory);
    EXPECT_EQ(reply.status(), 200u);
    EXPECT_EQ(reply.body(),
              R"({"station":"press","point":"oil","unit":"bar","every_ms":1000,"samples":[)"
              R"({"time":"2026-09-21T14:13:20.000000Z","value":21.5},)"
              R"({"time":"2026-09-21T14:13:21.000000Z","value":null},)"
              R"({"time":"2026-09-21T14:13:22.000000Z","value":0}]})"
              "\n");
    const Reply table = ask("GET", kOilHistory, "", kCsv);
    EXPECT_EQ(table.header("Content-Type"), "text/csv; charset=utf-8; header=present");
    EXPECT_EQ(table.body(),
              "time,value\r\n2026-09-21T14:13:20.000000Z,21.5\r\n"
              "2026-09-21T14:13:21.000000Z,\r\n2026-09-21T14:13:22.000000Z,0\r\n");
    record(1, true);
    EXPECT_THAT(get("/api/v1/stations/press/points/pump/history").body(),
                HasSubstr(R"("value":true)"));
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
    wait(6s);
    EXPECT_EQ(get("/api/v1/lines/floor1/history").body(),
              R"({"line":"floor1","every_ms":5000,"samples":[)"
              R"({"time":"2026-09-21T14:13:20.000000Z","load_percent":25,"requests":1,"errors":1,)"
              R"("latency_ms":12.35,"wire_ms":null,"queue_depth":0}]})"
              "\n");
    const Reply table = ask("GET", "/api/v1/lines/floor1/history", "", kCsv);
    EXPECT_THAT(table.body(), HasSubstr("time,load_percent,requests,errors,latency_ms,wire_ms,"
                                        "queue_depth\r\n"));
    EXPECT_THAT(table.body(), HasSubstr("Z,25,1,1,12.35,,0\r\n"));
}

TEST_F(ApiHistory, ALongOneIsWhole) {
    for (std::int64_t i = 0; i < 3600; ++i) {
        record(0, i);
        now += 1s;
    }
    now -= 1s;
    EXPECT_EQ(get(kOilHistory).at("samples").as_array().size(), 3600u);
}

TEST_F(ApiHistory, IsNotOfTextsAndNotOfWhatThereIsNot) {
    expect_gets("/api/v1/", 404,
                {"stations/press/points/name/history", "stations/press/points/nothing/history",
                 "lines/attic/history", "lines/floor2/history"});
}

}  // namespace
}  // namespace panelgate::web::points_test
