#include <cstddef>
#include <string>
#include <vector>

#include "http_rig.hpp"
#include "panelgate/points/station_points.hpp"

namespace panelgate::web::batch_test {
namespace {

using ::testing::ElementsAre;

/// press has a point oil (UW7, writable, 0 to 100).
class ApiBatch : public HttpRig {
  protected:
    ApiBatch() {
        points[0].scale = 0.5;
        directory.stations[0].points = &shown;
    }
    Reply read(const std::string& items) {
        return ask("POST", "/api/v1/read", "{\"items\":[" + items + "]}");
    }
    Reply write(const std::string& items) {
        return ask("POST", "/api/v1/write", "{\"items\":[" + items + "]}");
    }
    static boost::json::object result(const Reply& reply, std::size_t index) {
        return reply.at("results").as_array().at(index).as_object();
    }
    static std::string result(const Reply& reply, std::size_t index, const char* names) {
        return members(result(reply, index), names);
    }

    std::vector<points::Point> points{oil_point()};
    std::vector<points::Poll> blocks;
    std::vector<points::Reading> readings = std::vector<points::Reading>(1);
    points::StationPoints shown{points, blocks, readings};
};

constexpr const char* kUw = R"({"station":"press","device":"UW10","count":2})";
constexpr const char* kOil = R"({"point":"press/oil"})";

TEST_F(ApiBatch, ReadsNeighboursInOneRequestWithOneResultEach) {
    const Reply reply = read(std::string(kUw) + "," + kOil);
    EXPECT_EQ(reply.status(), 200u);
    EXPECT_EQ(reply.json(),
              json_of(R"({"results":[{"status":200,"station":"press","table":"holding-registers",
        "address":10,"notation":"UW10","notations":["UW10","UW11"],"values":[10,11],"age_ms":0,
        "source":"bus","item":{"station":"press","device":"UW10","count":2}},
        {"status":200,"station":"press","name":"oil","value":3.5,"unit":"bar","quality":"good",
         "age_ms":0,"source":"bus","item":{"point":"press/oil"}}],"transactions":1})"));
    EXPECT_EQ(last_pdu(), "03 00 07 00 05");
}

TEST_F(ApiBatch, TellsTypesAndRawItemsHoweverManyTransactionsTheyTake) {
    const Reply reply = read(
        R"({"station":"press","table":"holding-registers","address":1,"type":"u32",
            "order":"CDAB","raw":true},{"point":"press/oil","raw":true})");
    EXPECT_EQ(result(reply, 0, "values raw"), "[131073] [1,2]");
    EXPECT_EQ(result(reply, 1, "raw"), "[7]");
    const Reply large = read(R"({"station":"press","device":"UW0","count":70})");
    EXPECT_EQ(result(large, 0).at("transactions"), 3) << "cut for the panel's frame";
    const auto values = result(large, 0).at("values").as_array();
    ASSERT_EQ(values.size(), 70u);
    for (unsigned i = 0; i < 70; ++i) EXPECT_EQ(values[i], i);
}

TEST_F(ApiBatch, WhatCannotBeReadIsToldInItsPlace) {
    const Reply reply = read(std::string(R"({"point":"press/none"},{"station":"nobody",
        "device":"UW1"},{"station":"press","device":"UW5000"},)") +
                             kUw);
    EXPECT_EQ(reply.status(), 200u);
    EXPECT_EQ(result(reply, 0, "status detail"), "404 station 'press' has no point 'none'");
    EXPECT_EQ(result(reply, 1, "status"), "404");
    EXPECT_EQ(result(reply, 2, "status"), "422");
    EXPECT_EQ(result(reply, 3, "values"), "[10,11]");
}

TEST_F(ApiBatch, WhatAPanelRefusesFailsNobodyElse) {
    bus.script = [](const bus::Request& request) {
        const auto span = *request.request.span();
        const bool missing = span.first <= 11 && span.end() > 11;
        if (missing) return test::FakeBus::reply({0x83, 2});
        return answer_from_addresses(request);
    };
    const Reply reply = read(
        R"({"station":"press","device":"UW10"},{"station":"press","device":"UW11"},
           {"station":"press","device":"UW12"})");
    EXPECT_EQ(result(reply, 0, "values"), "[10]");
    EXPECT_EQ(result(reply, 1, "status modbus_exception"), "422 2");
    EXPECT_EQ(result(reply, 2, "values"), "[12]");
}

TEST_F(ApiBatch, P2AMistakeAnywhereAndNothingIsDone) {
    const Reply reply = write(R"({"station":"press","device":"UW1","values":[1]},
                                 {"station":"press","device":"UW2","valeus":[1]})");
    EXPECT_EQ(status_and(reply, "detail"),
              "400 items[1]: unknown member 'valeus'; did you mean 'values'?");
    for (const char* wrong :
         {"{}", "7", R"({"point":"oil"})", R"({"point":7})", R"({"point":"press/oil","count":2})",
          R"({"station":"press","table":"words","address":1})",
          R"({"station":"press","device":"UW1","count":0})"}) {
        EXPECT_EQ(read(wrong).status(), 400u) << wrong;
    }
    EXPECT_EQ(ask("POST", "/api/v1/read", R"({"items":[]})").status(), 400u);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiBatch, IsAsLongAsTheSettingsSay) {
    std::string items = kOil;
    for (int i = 0; i < 256; ++i) items += std::string(",") + kOil;
    EXPECT_EQ(status_and(read(items), "detail"), "422 at most 256 entries in one list");
    const std::string large = R"({"station":"floor1:9","table":"coils","address":0,"count":32000})";
    EXPECT_EQ(read(large).status(), 200u);
    bus.requests.clear();
    EXPECT_EQ(read(large + "," + large).at("detail"),
              "at most 32768 registers and bits in one list");
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiBatch, WritesInOrderWithOneResultEach) {
    add_meter();
    const Reply reply = write(R"({"id":"a","point":"press/oil","value":3.5},
        {"station":"meter","table":"coils","address":1,"values":[1]},
        {"station":"press","device":"UW1","values":[1,2]},{"point":"press/oil","value":300})");
    EXPECT_EQ(reply.status(), 200u);
    EXPECT_EQ(result(reply, 0),
              json_of(R"({"status":200,"transmitted":true,"confirmed":true,"value":3.5,
                          "item":{"id":"a","point":"press/oil","value":3.5}})"));
    EXPECT_EQ(result(reply, 1, "status"), "403");
    EXPECT_EQ(result(reply, 2, "confirmed"), "true");
    EXPECT_EQ(result(reply, 3, "status item"), R"(422 {"point":"press/oil","value":300})");
    EXPECT_THAT(pdus(), ElementsAre("06 00 07 00 07", "10 00 01 00 02 04 00 01 00 02"));
}

TEST_F(ApiBatch, AWriteThatFailsStopsNoOther) {
    bus.script = [](const bus::Request& request) {
        if (request.request.pdu()[2] == 1) return test::FakeBus::fault(Fault::timeout, true);
        return answer_from_addresses(request);
    };
    const Reply reply = write(R"({"station":"press","device":"UW1","values":[1]},
                                 {"station":"press","device":"UW2","values":[2]})");
    EXPECT_EQ(result(reply, 0, "status transmitted"), "504 true");
    EXPECT_EQ(result(reply, 1, "status"), "200");
}

TEST_F(ApiBatch, LinesAreAskedAtOnce) {
    test::FakeBus other(io.get_executor());
    directory.lines[1].bus = &other;
    StationEntry far = directory.stations[0];
    far.name = "far";
    far.line = "floor2";
    far.bus = &other;
    directory.stations.push_back(far);
    other.script = [&](const bus::Request& request) {
        EXPECT_EQ(bus.open(), 1u);  // press has not answered yet
        bus.release(answer_from_addresses(bus.requests.back()));
        return answer_from_addresses(request);
    };
    hold_answers();
    const Reply reply = read(std::string(kUw) + R"(,{"station":"far","device":"UW3"})");
    EXPECT_EQ(result(reply, 0, "values"), "[10,11]");
    EXPECT_EQ(result(reply, 1, "values"), "[3]");
    EXPECT_EQ(reply.at("transactions"), 2);
    server.reset();
    io.poll();
}

TEST_F(ApiBatch, P2WhoeverLeavesTakesWhatWaitsAlong) {
    hold_answers();
    ask_and_leave(http_text("POST", "/api/v1/read", "Content-Length: 40\r\n") +
                  R"({"items":[{"point":"press/oil"}]}       )");
    while (bus.cancelled.empty()) io.run_one();
    EXPECT_EQ(bus.cancelled, std::vector<bus::ClientId>{bus.requests[0].client});
}

}  // namespace
}  // namespace panelgate::web::batch_test
