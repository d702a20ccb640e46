#include "http_rig.hpp"

namespace panelgate::web::read_test {
namespace {

using ::testing::HasSubstr;
using ApiRead = HttpRig;

TEST_F(ApiRead, GivesRegistersWithWhereTheyCameFrom) {
    const Reply reply = get("/api/v1/stations/press/holding-registers/100?count=2");
    EXPECT_EQ(reply.status(), 200u);
    EXPECT_EQ(reply.header("Content-Type"), "application/json");
    EXPECT_EQ(reply.json(), json_of(R"({"station":"press","table":"holding-registers","address":100,
        "notation":"UW100","values":[100,101],"age_ms":0,"source":"bus"})"));
    EXPECT_EQ(last_pdu(), "03 00 64 00 02");
    EXPECT_EQ(bus.requests[0].station, 31);
    EXPECT_FALSE(bus.requests[0].poll);
    EXPECT_NE(bus.requests[0].client, 0u);
}

TEST_F(ApiRead, GivesBitsAsBooleans) {
    const Reply reply = get("/api/v1/stations/press/coils/0x120?count=3");
    EXPECT_EQ(reply.at("values"), json_of("[false,true,false]"));
    EXPECT_EQ(reply.at("notation"), "UB180");
    EXPECT_EQ(reply.at("address"), 288);
}

TEST_F(ApiRead, UnderstandsNegativeNumbersWhenAsked) {
    EXPECT_EQ(get("/api/v1/stations/press/holding-registers/65534?count=2&type=i16").at("values"),
              json_of("[-2,-1]"));
    EXPECT_EQ(get("/api/v1/stations/press/holding-registers/65534?type=u16").at("values"),
              json_of("[65534]"));
}

TEST_F(ApiRead, NamesTheTypesOfATable) {
    EXPECT_EQ(get("/api/v1/stations/press/holding-registers/1?type=float").at("detail"),
              "there is no type 'float'; there are bool, u16, i16, u32, i32, u64, i64, f32, f64, "
              "bcd16, bcd32, string");
    EXPECT_EQ(get("/api/v1/stations/press/coils/1?type=u16").at("detail"),
              "the type of a bit is bool, not u16");
    EXPECT_EQ(get("/api/v1/stations/press/coils/1?type=bool").status(), 200u);
}

TEST_F(ApiRead, CountsValuesAndNotRegisters) {
    const Reply reply = get("/api/v1/stations/press/holding-registers/1?type=u32&count=2&raw=true");
    EXPECT_EQ(last_pdu(), "03 00 01 00 04");
    EXPECT_EQ(reply.at("values"), json_of("[65538,196612]"));
    EXPECT_EQ(reply.at("raw"), json_of("[1,2,3,4]"));
    const Reply turned = get("/api/v1/stations/press/devices/UW1?type=u32&order=CDAB");
    EXPECT_EQ(turned.at("values"), json_of("[131073]"));
}

TEST_F(ApiRead, KnowsAllTypesThatPointsHave) {
    for (const points::Type type : points::kTypes) {
        const auto word = std::string(label(type));
        const Reply reply = get("/api/v1/stations/press/devices/UW16?type=" + word);
        ASSERT_EQ(reply.status(), 200u) << word;
        EXPECT_EQ(reply.at("values").as_array().size(), 1u) << word;
    }
}

TEST_F(ApiRead, ReadsTextsOfALengthOrOneOfAllRegisters) {
    bus.script = [](const bus::Request& request) {
        Writer out;
        out.u8(3).u8(2u * request.request.pdu()[4]);
        for (unsigned i = 0; i < request.request.pdu()[4]; ++i) out.u16(0x4142 + i * 0x202);
        return test::FakeBus::reply(out.take());
    };
    const std::string path = "/api/v1/stations/press/devices/UW0?type=string&count=2";
    EXPECT_EQ(get(path).at("values"), json_of(R"(["ABCD"])"));
    EXPECT_EQ(get(path + "&length=2").at("values"), json_of(R"(["AB","CD"])"));
    EXPECT_EQ(get("/api/v1/stations/press/devices/UW0?length=2").status(), 400u);
}

TEST_F(ApiRead, AValueThatIsNoneIsNull) {
    bus.script = [](const bus::Request&) {
        return test::FakeBus::reply({3, 4, 0x7f, 0xc0, 0, 0});  // a NaN
    };
    EXPECT_EQ(get("/api/v1/stations/press/devices/UW0?type=f32").at("values"), json_of("[null]"));
}

TEST_F(ApiRead, SaysWhichWordsAQueryTakes) {
    const std::string path = "/api/v1/stations/press/devices/UW0?";
    EXPECT_EQ(get(path + "order=LITTLE").at("detail"),
              "there is no order 'LITTLE'; there are ABCD, BADC, CDAB, DCBA");
    EXPECT_EQ(get(path + "raw=yes").at("detail"), "raw is true or false, not 'yes'");
    EXPECT_EQ(get("/api/v1/stations/press/coils/0?order=ABCD").at("detail"), "a bit has no order");
    EXPECT_EQ(get("/api/v1/stations/press/holding-registers/65535?type=u32").status(), 400u);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiRead, P3IsAnsweredWithinTheLinesDeadlineHoweverManyTransactionsItTakes) {
    directory.lines[0].deadline = 500ms;
    bus.script = [this](const bus::Request& request) {
        now += 200ms;
        if (request.within < 200ms) return test::FakeBus::fault(Fault::expired, false);
        return answer_from_addresses(request);
    };
    const Reply reply = get("/api/v1/stations/press/holding-registers/0?count=100");
    EXPECT_EQ(reply.status(), 503u);
    EXPECT_EQ(reply.at("detail"),
              "the time of this request was over after 64 of 100 items; ask for fewer at once");
    ASSERT_EQ(bus.requests.size(), 3u);
    EXPECT_EQ(bus.requests[0].within, 500ms);
    EXPECT_EQ(bus.requests[2].within, 100ms);
}

TEST_F(ApiRead, P3WaitsNoLongerThanItsClient) {
    const auto within = [&](const std::string& prefer) {
        ask("GET", "/api/v1/stations/press/coils/0", "", "Prefer: " + prefer + "\r\n");
        return bus.requests.back().within;
    };
    EXPECT_EQ(within("wait=1"), 1s);
    EXPECT_EQ(within("wait=10"), 2s);
    EXPECT_EQ(within("respond-async, wait=1;x=y"), 1s);
    EXPECT_EQ(within("wait=soon"), 2s);
    EXPECT_EQ(within("respond-async\r\nPrefer: wait=\"1\""), 1s);
}

TEST_F(ApiRead, ReadsByTheVendorsNotation) {
    const Reply reply = get("/api/v1/stations/press/devices/uw00100?count=2");
    EXPECT_EQ(reply.json(), json_of(R"({"station":"press","table":"holding-registers","address":100,
        "notation":"UW100","values":[100,101],"age_ms":0,"source":"bus"})"));
}

TEST_F(ApiRead, UsesTheFunctionThatThePanelHas) {
    EXPECT_EQ(get("/api/v1/stations/press/devices/GDT7").at("table"), "holding-registers");
    EXPECT_EQ(last_pdu(), "03 00 07 00 01");
    const Reply reply = get("/api/v1/stations/press/devices/TM7");
    EXPECT_EQ(reply.status(), 422u);
    EXPECT_EQ(reply.at("detail"), "the panel has no function that reads TM");
    EXPECT_EQ(bus.requests.size(), 1u);
}

TEST_F(ApiRead, SplitsWhatThePanelCannotGiveAtOnceAndSaysSo) {
    const Reply reply = get("/api/v1/stations/press/holding-registers/10?count=70");
    EXPECT_EQ(reply.at("transactions"), 3);
    const auto values = reply.at("values").as_array();
    ASSERT_EQ(values.size(), 70u);
    for (unsigned i = 0; i < 70; ++i) EXPECT_EQ(values[i], 10 + i);
    ASSERT_EQ(bus.requests.size(), 3u);
    EXPECT_EQ(to_hex(bus.requests[0].request.pdu()), "03 00 0a 00 20");
    EXPECT_EQ(to_hex(bus.requests[1].request.pdu()), "03 00 2a 00 20");
    EXPECT_EQ(to_hex(bus.requests[2].request.pdu()), "03 00 4a 00 06");
    EXPECT_EQ(bus.requests[2].client, bus.requests[0].client);
}

TEST_F(ApiRead, UsesTheStandardsLimitsWithoutAProfile) {
    EXPECT_EQ(
        get("/api/v1/stations/floor1:9/holding-registers/0?count=125").json().count("transactions"),
        0u);
    EXPECT_EQ(get("/api/v1/stations/floor1:9/holding-registers/0?count=126").at("transactions"), 2);
    EXPECT_EQ(get("/api/v1/stations/floor1:9/coils/0?count=2001").at("transactions"), 2);
}

TEST_F(ApiRead, P1AFailedPartFailsTheWholeRead) {
    bus.script = [](const bus::Request& request) {
        if (request.request.pdu()[2] == 0) return answer_from_addresses(request);
        return test::FakeBus::fault(Fault::timeout, true);
    };
    EXPECT_EQ(get("/api/v1/stations/press/holding-registers/0?count=40").status(), 504u);
}

TEST_F(ApiRead, BoundsTheBusTimeOfOneRequest) {
    const Reply reply = get("/api/v1/stations/press/holding-registers/0?count=2049");
    EXPECT_EQ(reply.status(), 422u);
    EXPECT_EQ(reply.at("detail"), "at most 2048 at once");
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiRead, LetsThePanelJudgeARawAddressButNotANotation) {
    EXPECT_EQ(get("/api/v1/stations/press/holding-registers/5000").status(), 200u);
    EXPECT_EQ(bus.requests.size(), 1u);
    const Reply many = get("/api/v1/stations/press/devices/UW998?count=3");
    EXPECT_EQ(many.status(), 422u);
    EXPECT_THAT(std::string(many.at("detail").as_string()), HasSubstr("UW0 to UW999"));
    EXPECT_EQ(get("/api/v1/stations/press/devices/UW1000").status(), 422u);
    EXPECT_EQ(bus.requests.size(), 1u);
}

TEST_F(ApiRead, SaysHowOldACachedValueIs) {
    bus.script = [](const bus::Request& request) {
        bus::Answer answer = answer_from_addresses(request);
        answer.source = bus::Source::cache;
        answer.age = 120ms;
        return answer;
    };
    const Reply reply = get("/api/v1/stations/press/holding-registers/0");
    EXPECT_EQ(reply.at("source"), "cache");
    EXPECT_EQ(reply.at("age_ms"), 120);
}

TEST_F(ApiRead, HasNoNotationForAPanelItDoesNotKnow) {
    const Reply reply = get("/api/v1/stations/floor1:9/input-registers/3");
    EXPECT_EQ(reply.at("notation"), nullptr);
    EXPECT_EQ(reply.at("station"), "floor1:9");
    EXPECT_EQ(get("/api/v1/stations/floor1:9/devices/UW3").status(), 422u);
}

TEST_F(ApiRead, RefusesWhatIsMalformed) {
    const std::string base = "/api/v1/stations/press/";
    for (const char* path : {"coils/65536", "coils/-1", "coils/1x", "coils/0x", "coils/1?count=0",
                             "coils/1?count=x", "coils/65535?count=2"}) {
        EXPECT_EQ(get(base + path).status(), 400u) << path;
    }
    EXPECT_EQ(get(base + "coils/65535").status(), 200u);
}

TEST_F(ApiRead, KnowsNoOtherStationsTablesOrNotations) {
    for (const char* path :
         {"nobody/coils/1", "press/relays/1", "press/devices/XY1", "floor2:9/coils/1",
          "floor1:248/coils/1", "floor1:0/coils/1", "floor1:x/coils/1", "floor3:1/coils/1"}) {
        const Reply reply = get(std::string("/api/v1/stations/") + path);
        EXPECT_EQ(reply.status(), 404u) << path;
        EXPECT_EQ(reply.header("Content-Type"), "application/problem+json");
    }
}

TEST_F(ApiRead, GivesAPanelsExceptionWithTheManualsWord) {
    bus.script = [](const bus::Request&) { return test::FakeBus::reply({0x83, 2}); };
    const Reply reply = get("/api/v1/stations/press/holding-registers/5000");
    EXPECT_EQ(reply.status(), 422u);
    EXPECT_EQ(reply.at("status"), 422);
    EXPECT_EQ(reply.at("title"), "Unprocessable Content");
    EXPECT_EQ(reply.at("modbus_exception"), 2);
    EXPECT_EQ(reply.at("transmitted"), true);
    EXPECT_THAT(std::string(reply.at("detail").as_string()),
                HasSubstr("Address is outside the range"));
}

TEST_F(ApiRead, MapsExceptionsOneToFourTo422AndAllOthersTo502) {
    for (unsigned code = 1; code <= 11; ++code) {
        bus.script = [code](const bus::Request&) {
            return test::FakeBus::reply({0x83, static_cast<std::uint8_t>(code)});
        };
        const Reply reply = get("/api/v1/stations/press/holding-registers/1");
        EXPECT_EQ(reply.status(), code <= 4 ? 422u : 502u) << code;
        EXPECT_EQ(reply.at("modbus_exception"), code);
    }
}

struct FaultCase {
    Fault fault;
    bool transmitted;
    unsigned status;
    int exception;
};
class ApiFault : public HttpRig, public ::testing::WithParamInterface<FaultCase> {};

TEST_P(ApiFault, HasItsStatus) {
    const FaultCase& c = GetParam();
    bus.script = [c](const bus::Request&) { return test::FakeBus::fault(c.fault, c.transmitted); };
    const Reply reply = get("/api/v1/stations/press/holding-registers/1");
    EXPECT_EQ(reply.status(), c.status);
    EXPECT_EQ(reply.at("type").as_string(), "urn:panelgate:problem:" + std::string(label(c.fault)));
    EXPECT_EQ(reply.at("transmitted"), c.transmitted);
    EXPECT_EQ(reply.at("modbus_exception"), c.exception);
    EXPECT_EQ(reply.header("Retry-After"), c.status == 503 ? "1" : "");
}

INSTANTIATE_TEST_SUITE_P(Bus, ApiFault,
                         ::testing::Values(FaultCase{Fault::denied, false, 403, 1},
                                           FaultCase{Fault::malformed, false, 400, 3},
                                           FaultCase{Fault::not_routed, false, 404, 10},
                                           FaultCase{Fault::busy, false, 503, 6},
                                           FaultCase{Fault::expired, false, 503, 6},
                                           FaultCase{Fault::line_down, false, 502, 10},
                                           FaultCase{Fault::line_lost, true, 502, 11},
                                           FaultCase{Fault::timeout, true, 504, 11},
                                           FaultCase{Fault::damaged, true, 502, 11},
                                           FaultCase{Fault::offline, false, 504, 11},
                                           FaultCase{Fault::cancelled, false, 503, 10}));

}  // namespace
}  // namespace panelgate::web::read_test
