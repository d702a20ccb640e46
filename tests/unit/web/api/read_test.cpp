// Reads: which items a path names, how they are asked for, what the answer says.
#include <boost/asio/co_spawn.hpp>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "exchange.hpp"
#include "http_rig.hpp"

namespace panelgate::web::read_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kRegisters = "/api/v1/stations/press/holding-registers/";
constexpr const char* kDevices = "/api/v1/stations/press/devices/";

class ApiRead : public HttpRig {
  protected:
    Reply registers(const std::string& rest) { return get(kRegisters + rest); }
    Reply devices(const std::string& rest) { return get(kDevices + rest); }
};

TEST_F(ApiRead, GivesItemsWithWhereTheyCameFrom) {
    for (const char* path : {"holding-registers/100?count=2", "devices/uw00100?count=2"}) {
        const Reply reply = get(std::string("/api/v1/stations/press/") + path);
        EXPECT_EQ(reply.status(), 200u);
        EXPECT_EQ(reply.header("Content-Type"), "application/json");
        EXPECT_EQ(reply.json(), json_of(R"({"station":"press","table":"holding-registers",
            "address":100,"notation":"UW100","notations":["UW100","UW101"],"values":[100,101],
            "age_ms":0,"source":"bus"})"));
        EXPECT_EQ(last_pdu(), "03 00 64 00 02");
    }
    EXPECT_EQ(bus.requests[0].station, 31);
    EXPECT_FALSE(bus.requests[0].poll);
    EXPECT_NE(bus.requests[0].client, 0u);
    EXPECT_EQ(
        status_and(get("/api/v1/stations/press/coils/0x120?count=3"), "values notations address"),
        "200 [false,true,false] [\"UB180\",\"UB181\",\"UB182\"] 288");
}

TEST_F(ApiRead, SaysHowOldACachedValueIs) {
    bus.script = [](const bus::Request& request) {
        bus::Answer answer = answer_from_addresses(request);
        answer.source = bus::Source::cache;
        answer.age = 120ms;
        return answer;
    };
    EXPECT_EQ(status_and(registers("0"), "source age_ms"), "200 cache 120");
}

TEST_F(ApiRead, CountsValuesAndNotRegisters) {
    EXPECT_EQ(status_and(registers("1?type=u32&count=2&raw=true"), "values raw"),
              "200 [65538,196612] [1,2,3,4]");
    EXPECT_EQ(last_pdu(), "03 00 01 00 04");
    EXPECT_EQ(devices("UW1?type=u32&order=CDAB").at("values"), json_of("[131073]"));
    EXPECT_EQ(registers("65534?count=2&type=i16").at("values"), json_of("[-2,-1]"));
    EXPECT_EQ(registers("65534?type=u16").at("values"), json_of("[65534]"));
}

TEST_F(ApiRead, KnowsAllTypesThatPointsHave) {
    for (const points::Type type : points::kTypes) {
        const auto word = std::string(label(type));
        const Reply reply = devices("UW16?type=" + word);
        ASSERT_EQ(reply.status(), 200u) << word;
        EXPECT_EQ(reply.at("values").as_array().size(), 1u) << word;
    }
    EXPECT_EQ(get("/api/v1/stations/press/coils/1?type=bool").status(), 200u);
    answer_with({3, 4, 0x7f, 0xc0, 0, 0});  // a NaN
    EXPECT_EQ(devices("UW0?type=f32").at("values"), json_of("[null]"));
}

TEST_F(ApiRead, ReadsTextsOfALengthOrOneOfAllRegisters) {
    bus.script = [](const bus::Request& request) {
        Writer out;
        out.u8(3).u8(2u * request.request.pdu()[4]);
        for (unsigned i = 0; i < request.request.pdu()[4]; ++i) out.u16(0x4142 + i * 0x202);
        return test::FakeBus::reply(out.take());
    };
    EXPECT_EQ(devices("UW0?type=string&count=2").at("values"), json_of(R"(["ABCD"])"));
    EXPECT_EQ(devices("UW0?type=string&count=2&length=2").at("values"), json_of(R"(["AB","CD"])"));
    EXPECT_EQ(devices("UW0?length=2").status(), 400u);
}

TEST_F(ApiRead, SaysWhichWordsAQueryTakes) {
    expect_gets(
        "/api/v1/stations/press/",
        {{"holding-registers/1?type=float", 400,
          "there is no type 'float'; there are bool, u8h, u8l, i8h, i8l, u16, i16, u32, i32, u48, "
          "i48, u64, i64, f16, f32, f64, bcd16, bcd32, string"},
         {"coils/1?type=u16", 400, "the type of a bit is bool, not u16"},
         {"devices/UW0?order=LITTLE", 400,
          "there is no order 'LITTLE'; there are ABCD, BADC, CDAB, DCBA"},
         {"devices/UW0?raw=yes", 400, "raw is true or false, not 'yes'"},
         {"coils/0?order=ABCD", 400, "a bit has no order"},
         {"holding-registers/65535?type=u32", 400}});
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiRead, P3IsAnsweredWithinTheLinesDeadlineHoweverManyTransactionsItTakes) {
    directory.lines[0].deadline = 500ms;
    bus.script = [this](const bus::Request& request) {
        now += 200ms;
        if (request.within < 200ms) return test::FakeBus::fault(Fault::expired, false);
        return answer_from_addresses(request);
    };
    expect_gets(kRegisters, {{"0?count=100", 503,
                              "the time of this request was over after 64 of 100 items; ask for "
                              "fewer at once"}});
    ASSERT_EQ(bus.requests.size(), 3u);
    EXPECT_EQ(bus.requests[0].within, 500ms);
    EXPECT_EQ(bus.requests[2].within, 100ms);
}

TEST_F(ApiRead, UsesTheFunctionThatThePanelHas) {
    panel.areas[3].also = {modbus::Table::discrete_inputs, modbus::Table::holding_registers};
    EXPECT_EQ(devices("GDT7").at("table"), "holding-registers");
    EXPECT_EQ(last_pdu(), "03 00 07 00 01");
    expect_gets(kDevices, {{"TM7", 422, "the panel has no function that reads TM"}});
    EXPECT_EQ(bus.requests.size(), 1u);
    panel.functions.push_back({4, 0, false, ""});
    EXPECT_EQ(devices("GDT7").at("table"), "input-registers") << "the area's own table";
}

TEST_F(ApiRead, SplitsWhatThePanelCannotGiveAtOnceAndSaysSo) {
    const Reply reply = registers("10?count=70");
    EXPECT_EQ(reply.at("transactions"), 3);
    const auto values = reply.at("values").as_array();
    ASSERT_EQ(values.size(), 70u);
    for (unsigned i = 0; i < 70; ++i) EXPECT_EQ(values[i], 10 + i);
    EXPECT_THAT(pdus(), ElementsAre("03 00 0a 00 20", "03 00 2a 00 20", "03 00 4a 00 06"));
    EXPECT_EQ(bus.requests[2].client, bus.requests[0].client);
    const std::string unlisted = "/api/v1/stations/floor1:9/";  // the standard's limits
    EXPECT_EQ(get(unlisted + "holding-registers/0?count=125").json().count("transactions"), 0u);
    EXPECT_EQ(get(unlisted + "holding-registers/0?count=126").at("transactions"), 2);
    EXPECT_EQ(get(unlisted + "coils/0?count=2001").at("transactions"), 2);
    bus.requests.clear();
    expect_gets(kRegisters, {{"0?count=2049", 422, "at most 2048 at once"}});
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiRead, P1AFailedPartFailsTheWholeRead) {
    bus.script = [](const bus::Request& request) {
        if (request.request.pdu()[2] == 0) return answer_from_addresses(request);
        return test::FakeBus::fault(Fault::timeout, true);
    };
    EXPECT_EQ(registers("0?count=40").status(), 504u);
}

TEST_F(ApiRead, LetsThePanelJudgeARawAddressButNotANotation) {
    EXPECT_EQ(registers("5000").status(), 200u);
    EXPECT_EQ(get("/api/v1/stations/press/input-registers/1").status(), 200u);
    EXPECT_EQ(last_pdu(), "04 00 01 00 01") << "also by a function that the panel lacks";
    EXPECT_EQ(bus.requests.size(), 2u);
    expect_gets(kDevices, {{"UW998?count=3", 422,
                            "3 from UW address 998 is outside what is readable: UW0 to UW999"}});
    expect_gets(kDevices, 422, {"UW1000", "UW70000"});
    EXPECT_EQ(bus.requests.size(), 2u);
}

TEST_F(ApiRead, HasNoNotationForAPanelItDoesNotKnow) {
    EXPECT_EQ(status_and(get("/api/v1/stations/floor1:9/input-registers/3"), "notation station"),
              "200 null floor1:9");
    expect_gets("/api/v1/stations/",
                {{"floor1:9/devices/UW3", 422,
                  "station 'floor1:9' has no profile that explains notations; read its tables"}});
}

TEST_F(ApiRead, FindsAnAddressThatTheStandardReservesOnlyWhereItIsListed) {
    const std::string path = "/api/v1/stations/floor1:250/coils/0";
    EXPECT_EQ(get(path).status(), 404u);
    directory.stations[0].id = 250;
    EXPECT_EQ(get(path).status(), 200u);
    EXPECT_EQ(bus.requests.back().station, 250);
    EXPECT_FALSE(bus.requests.back().verbatim) << "values are taken out of the reply";
}

TEST_F(ApiRead, RefusesWhatIsMalformed) {
    const char* coils = "/api/v1/stations/press/coils/";
    for (const char* text : {"65536", "0x10000", "-1", "1x", "1f", "0x", "0x0x1"}) {
        expect_gets(coils, {{text, 400,
                             "'" + std::string(text) +
                                 "' is not an address: 0 to 65535, or 0x0000 to 0xFFFF"}});
    }
    expect_gets(coils, {{"65535?count=2", 400, "count must be a whole number from 1 to 1"}});
    expect_gets(coils, 400, {"1%20", "1?count=0", "1?count=x"});
    expect_gets(coils, 200, {"65535?count=1", "065535", "0XFFFF"});
}

TEST_F(ApiRead, KnowsNoOtherStationsTablesOrNotations) {
    expect_gets("/api/v1/stations/", 404,
                {"nobody/coils/1", "press/relays/1", "press/devices/XY1", "floor1:248/coils/1",
                 "floor1:0/coils/1", "floor1:x/coils/1", "floor3:1/coils/1", "x/x/x?count=x",
                 "press/x/x?count=x"});  // from the left to the right
    expect_gets("/api/v1/stations/",
                {{"press/coils/x?count=x", 400},
                 {"floor2:9/coils/1", 404, "there is no station 'floor2:9'"},
                 {"press/Coils/1", 404,
                  "there is no table 'Coils'; there are coils, discrete-inputs, input-registers "
                  "and holding-registers"}});
    EXPECT_EQ(get("/api/v1/stations/press/relays/1").header("Content-Type"),
              "application/problem+json");
    for (const modbus::Table table : modbus::kTables) {
        const Reply reply = get("/api/v1/stations/press/" + std::string(label(table)) + "/1");
        EXPECT_EQ(reply.at("table").as_string(), label(table));
    }
}

TEST_F(ApiRead, GivesAPanelsExceptionWithTheManualsWord) {
    answer_with({0x83, 2});
    const Reply reply = registers("5000");
    EXPECT_EQ(status_and(reply, "status title modbus_exception transmitted"),
              "422 422 Unprocessable Content 2 true");
    EXPECT_THAT(detail_of(reply), HasSubstr("Address is outside the range"));
}

/// Plans of requests, of which none goes out.
class Plan : public HttpRig {
  protected:
    void TearDown() override { EXPECT_TRUE(bus.requests.empty()); }
    /// The frame without its CRC.
    std::string frame(const std::string& path) {
        const std::string whole(get("/api/v1/stations/" + path).at("frame").as_string());
        return whole.substr(0, whole.size() - 6);
    }
};

TEST_F(Plan, ShowsTheFrameOfAReadAndTheNotationOfEachItem) {
    for (const char* path : {"devices/UW100", "holding-registers/100"}) {
        const Reply plan = get("/api/v1/stations/press/" + std::string(path) + "/plan?count=3");
        EXPECT_EQ(status_and(plan, "frame table address requests notations"),
                  "200 1F 03 00 64 00 03 47 AA holding-registers 100 1 "
                  R"(["UW100","UW101","UW102"])");
    }
    EXPECT_EQ(status_and(get("/api/v1/stations/press/devices/UW0/plan?count=70"), "requests count"),
              "200 3 32");
    add_meter();
    EXPECT_EQ(get("/api/v1/stations/meter/coils/7/plan").at("notations"), json_of("[]"));
    EXPECT_EQ(frame("meter/coils/7/plan?count=2"), "05 01 00 07 00 02");
}

TEST_F(Plan, OfAWriteHasItsValuesAndTheFunctionThatThePanelHas) {
    EXPECT_EQ(frame("press/devices/UW100/plan?values=5"), "1F 06 00 64 00 05");
    EXPECT_EQ(frame("press/devices/UW100/plan?values=5,6"), "1F 10 00 64 00 02 04 00 05 00 06");
    panel.functions.erase(panel.functions.begin() + 3);  // 06
    EXPECT_EQ(frame("press/holding-registers/1/plan?values=5"), "1F 10 00 01 00 01 02 00 05");
}

TEST_F(Plan, TellsWhyThereIsNone) {
    expect_gets("/api/v1/stations/", 404, {"press/devices/XY1/plan", "none/coils/1/plan"});
    expect_gets(kDevices, 422, {"UW998/plan?count=5", "UW500/plan?values=1"});
    expect_gets(kDevices, 405, {"TM1/plan?values=1"});
    expect_gets(kDevices, 400, {"UW1/plan?values=x", "UW1/plan?values=99999"});
}

/// ask() without a server.
class Ask : public HttpRig {
  protected:
    Ask() { hold_answers(); }
    void ask_once() {
        bus::Request request{
            .station = 5,
            .request = modbus::Request::read({modbus::Table::holding_registers, 0, 1})};
        boost::asio::co_spawn(io, web::ask(caller, &bus, std::move(request), Patience(2s, clock)),
                              [this](std::exception_ptr failed, bus::Answer answer) {
                                  ++ended;
                                  if (failed) {
                                      ++aborted;
                                  } else {
                                      got = std::move(answer);
                                  }
                              });
        run();
    }
    void run() {
        io.restart();
        io.poll();
    }

    std::shared_ptr<Caller> caller = std::make_shared<Caller>(12, "10.0.0.7");
    std::function<TimePoint()> clock = [this] { return now; };
    std::optional<bus::Answer> got;
    int ended = 0;
    int aborted = 0;
};

TEST_F(Ask, AsksAsTheCaller) {
    ask_once();
    ASSERT_EQ(bus.requests.size(), 1u);
    EXPECT_EQ(bus.requests[0].client, 12u);
    EXPECT_EQ(bus.names[12], "http 10.0.0.7");
    EXPECT_EQ(bus.requests[0].who->address, "10.0.0.7");
    EXPECT_EQ(bus.requests[0].who->host, host_number("10.0.0.7"));
    EXPECT_EQ(bus.requests[0].station, 5u);
    bus.release(test::FakeBus::reply({3, 2, 0, 7}));
    run();
    ASSERT_TRUE(got);
    EXPECT_EQ(*got->pdu, (Bytes{3, 2, 0, 7}));
    caller = std::make_shared<Caller>(13, "");
    ask_once();
    EXPECT_EQ(bus.requests[1].who->host, 0u) << "no address, no host";
}

TEST_F(Ask, TakesBackOnceWhatACallerThatLeavesHasAskedForAndSendsNothingMore) {
    ask_once();
    ask_once();
    caller->leave();
    run();
    EXPECT_EQ(bus.cancelled, std::vector<bus::ClientId>{12});
    EXPECT_EQ(ended, 2);
    EXPECT_EQ(aborted, 2);
    ask_once();
    EXPECT_EQ(bus.requests.size(), 2u);
    EXPECT_EQ(aborted, 3);
}

}  // namespace
}  // namespace panelgate::web::read_test
