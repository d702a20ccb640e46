#include "http_rig.hpp"

namespace panelgate::web {
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
    const Reply registers = get("/api/v1/stations/press/holding-registers/1?type=f32");
    EXPECT_EQ(registers.status(), 400u);
    EXPECT_EQ(registers.at("detail"), "the type of a register is u16 or i16");
    EXPECT_EQ(get("/api/v1/stations/press/coils/1?type=u16").at("detail"),
              "the type of a bit is bool");
    EXPECT_EQ(get("/api/v1/stations/press/coils/1?type=bool").status(), 200u);
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
}  // namespace panelgate::web
