// Writes: what goes out, what is refused, and what is read back.
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "exchange.hpp"
#include "http_rig.hpp"

namespace panelgate::web::write_test {
namespace {

using modbus::Table;
using ::testing::HasSubstr;

class ApiWrite : public HttpRig {
  protected:
    Reply put(const std::string& path, const std::string& body) {
        return ask("PUT", kStations + path, body);
    }
    /// PUTs of {"values":[...]} that are refused; nothing goes out.
    struct Refused {
        const char* path;
        const char* values;
        unsigned status;
        const char* detail = "";
    };
    void expect_refused(std::initializer_list<Refused> rows) {
        const std::size_t before = bus.requests.size();
        for (const Refused& row : rows)
            expect({std::string(row.path) + ' ' + row.values, row.status, row.detail},
                   put(row.path, std::string("{\"values\":[") + row.values + "]}"));
        EXPECT_EQ(bus.requests.size(), before);
    }
    /// The PDU of a write that is confirmed.
    std::string sent(const std::string& path, const std::string& body) {
        const Reply reply = put(path, body);
        EXPECT_EQ(reply.status(), 200u) << path << ' ' << body;
        EXPECT_EQ(reply.json(), json_of(R"({"transmitted":true,"confirmed":true})"));
        return last_pdu();
    }
    static inline const std::string kStations = "/api/v1/stations/";
};

TEST_F(ApiWrite, WritesByTheFunctionThatThePanelHas) {
    struct Row {
        const char* path;
        const char* body;
        const char* pdu;
    };
    constexpr Row kRows[] = {
        // one register by 06, several by one 16
        {"press/holding-registers/100", R"({"values":[258]})", "06 00 64 01 02"},
        {"press/holding-registers/65535", R"({"values":[5]})", "06 ff ff 00 05"},
        {"press/devices/UW100", R"({"value":-2})", "06 00 64 ff fe"},
        {"press/holding-registers/0x64", R"({"values":[1,-1,65535]})",
         "10 00 64 00 03 06 00 01 ff ff ff ff"},
        {"press/devices/UW498", R"({"values":[1,2]})", "10 01 f2 00 02 04 00 01 00 02"},
        // bits as booleans or numbers
        {"press/coils/1", R"({"values":[true]})", "05 00 01 ff 00"},
        {"press/devices/UB180", R"({"values":[0]})", "05 01 20 00 00"},
        {"floor1:9/coils/1", R"({"values":[1,false,true]})", "0f 00 01 00 03 01 05"},
        // an area of inputs through the other table that reaches it
        {"press/devices/GDT3", R"({"values":[9]})", "06 00 03 00 09"},
        // types by their order
        {"press/devices/UW100", R"({"value":21.5,"type":"f32"})", "10 00 64 00 02 04 41 ac 00 00"},
        {"press/devices/UW100", R"({"values":[21.5,-1],"type":"f32","order":"CDAB"})",
         "10 00 64 00 04 08 00 00 41 ac 00 00 bf 80"},
        {"press/holding-registers/100", R"({"value":"AB","type":"string"})", "06 00 64 41 42"},
    };
    for (const Row& row : kRows) EXPECT_EQ(sent(row.path, row.body), row.pdu) << row.body;
    EXPECT_FALSE(bus.requests[0].poll);
    std::erase_if(panel.functions, [](const auto& rule) { return rule.code == 6; });
    EXPECT_EQ(sent("press/devices/UW2", R"({"values":[7]})"), "10 00 02 00 01 02 00 07");
}

TEST_F(ApiWrite, NeverSplitsAWrite) {
    EXPECT_EQ(put("press/holding-registers/0", R"({"values":[1,2,3,4]})").status(), 200u);
    const Reply reply = put("press/holding-registers/0", R"({"values":[1,2,3,4,5]})");
    EXPECT_EQ(status_and(reply, "rule transmitted detail"),
              "422 quantity false at most 4 values in one write; writes are not split");
    EXPECT_EQ(bus.requests.size(), 1u);
    std::string many = "0";
    for (int i = 1; i < 123; ++i) many += ",0";
    EXPECT_TRUE(sent("floor1:9/holding-registers/0", "{\"values\":[" + many + "]}")
                    .starts_with("10 00 00 00 7b"));
    many += ",0";
    expect_refused({{"floor1:9/holding-registers/0", many.c_str(), 422,
                     "at most 123 values in one write; writes are not split"}});
}

TEST_F(ApiWrite, RefusesWhatThePanelHasNotAndWhatIsReadOnly) {
    add_meter();
    expect_refused(
        {{"press/coils/0", "1,0", 422, "the panel has no function 0F for 2 of its coils"},
         {"press/devices/TM1", "1", 405},
         {"meter/coils/1", "1", 403},
         {"floor1:5/coils/1", "1", 403},
         {"press/devices/UW499", "9,9", 422,
          "2 from UW address 499 is outside what is writable: UW0 to UW499"},
         {"press/holding-registers/65535", "1,2", 422, "these values go beyond address 65535"}});
    for (const char* table : {"discrete-inputs", "input-registers"}) {
        const Reply reply = put(std::string("press/") + table + "/1", R"({"values":[1]})");
        EXPECT_EQ(reply.status(), 405u);
        EXPECT_EQ(reply.header("Allow"), "GET, HEAD");
    }
    panel.areas[0].writable.reset();
    std::erase_if(panel.functions, [](const auto& rule) { return rule.code == 16; });
    expect_refused({{"press/devices/UW1", "9", 422},
                    {"press/holding-registers/1", "9,9", 422,
                     "the panel has no function 10 for 2 of its holding-registers"}});
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiWrite, RefusesValuesThatDoNotFit) {
    expect_bodies("PUT", "/api/v1/stations/press/holding-registers/1", 400,
                  {R"({"values":[65536]})", R"({"value":7,"values":[7]})", "{}", "",
                   R"({"values":[1e999]})"});
    expect_bodies("PUT", "/api/v1/stations/press/coils/1", 400, {R"({"values":[2]})"});
    for (const char* body :
         {R"({"value":1e39,"type":"f32"})", R"({"value":70000,"type":"u16"})",
          R"({"value":1,"type":"f33"})", R"({"value":1,"type":"f32","order":"XY"})",
          R"({"value":"AB","type":"f32"})", R"({"value":1,"length":3})"}) {
        const unsigned status = put("press/holding-registers/1", body).status();
        EXPECT_TRUE(status == 400 || status == 422) << body << " " << status;
    }
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiWrite, CallsAValueOfATypeByItsPlaceInTheBody) {
    const auto detail = [&](const char* body) {
        const Reply reply = put("press/holding-registers/1", body);
        EXPECT_EQ(reply.header("Content-Type"), "application/problem+json") << body;
        return detail_of(reply);
    };
    EXPECT_EQ(detail(R"({"value":70000,"type":"u16"})"),
              "value must be from 0 to 65535 (u16), not 70000");
    EXPECT_EQ(detail(R"({"values":[1,"x"],"type":"u16"})"),
              "values[1] takes a number, not the text 'x'");
    EXPECT_EQ(detail(R"({"values":[1.5],"type":"i16"})"),
              "values[0] cannot be exactly 1.5 (i16); the nearest that it can be are 1 and 2");
    EXPECT_EQ(detail(R"({"value":"ABC","type":"string","length":2})"),
              "value holds 2 characters, not 3");
    EXPECT_EQ(detail(R"({"value":1,"type":"string"})"), "value takes a text");
    EXPECT_EQ(detail(R"({"value":true,"type":"f32"})"), "value takes a number, not true");
    for (const char* body : {"5", "[5]", "\"x\"", "null"})
        EXPECT_EQ(detail(body), "the body must be a JSON object") << body;
}

TEST_F(ApiWrite, AFaultOfASimulatedPanelIsCalledByItsNameAlsoIfThatIsEmpty) {
    SimulatedPanel simulated;
    simulated.faults = [] { return std::map<std::string, double>(); };
    directory.stations[0].simulated = std::make_shared<const SimulatedPanel>(std::move(simulated));
    EXPECT_EQ(ask("PUT", "/api/v1/simulator/press", R"({"":"x"})").at("detail"),
              "the fault '' must be a number, true or false");
}

TEST_F(ApiWrite, P2WhatMayBeAMistakeIsNotExecuted) {
    for (const char* body : {R"({"values":[1],"values":[2]})", R"({"values":[1],"valeus":[3]})",
                             R"({"values":[1],"Values":[1]})", R"({"Values":[1]})"}) {
        EXPECT_EQ(put("press/holding-registers/1", body).status(), 400u) << body;
    }
    for (const char* query : {"count=7", "cuont=1", "=1"}) {
        const std::string path = std::string("press/holding-registers/1?") + query;
        EXPECT_EQ(put(path, R"({"values":[1]})").status(), 400u) << query;
    }
    EXPECT_TRUE(bus.requests.empty());
    EXPECT_THAT(detail_of(put("press/coils/1", "{\"values\":\n  [1,]}")),
                HasSubstr("line 2, column 6"));
    EXPECT_THAT(detail_of(put("press/coils/1", "{} x")), HasSubstr("line 1, column 4"));
}

TEST_F(ApiWrite, P2TellsAWriteWithoutAnAnswerFromOneThatNeverLeft) {
    answer_with(Fault::timeout, true);
    const auto told = [&] {
        return status_and(put("press/coils/1", R"({"values":[1]})"),
                          "transmitted modbus_exception");
    };
    EXPECT_EQ(told(), "504 true 11");
    answer_with(Fault::offline, false);
    EXPECT_EQ(told(), "504 false 11");
    EXPECT_EQ(bus.requests.size(), 2u);
    answer_with({0x85, 3});
    EXPECT_EQ(told(), "422 true 3");
}

using Cells = std::vector<std::uint16_t>;

Verification of(const Bytes& pdu) {
    return *Verification::of(*modbus::Request::make(pdu, modbus::QuantityCheck::wide));
}

TEST(Verification, KnowsWhatEachWriteLeaves) {
    EXPECT_TRUE(of({5, 0, 9, 0xff, 0}).holds(Cells{1}));
    EXPECT_FALSE(of({5, 0, 9, 0, 0}).holds(Cells{1}));
    EXPECT_TRUE(of({6, 0, 9, 1, 2}).holds(Cells{0x102}));
    const Verification coils = of({15, 0, 9, 0, 9, 2, 0x81, 1});
    EXPECT_TRUE(coils.holds(Cells{1, 0, 0, 0, 0, 0, 0, 1, 1}));
    EXPECT_FALSE(coils.holds(Cells{1, 0, 0, 0, 0, 0, 0, 1, 0}));
    const Verification words = of({16, 0, 9, 0, 2, 4, 0, 1, 0, 2});
    EXPECT_TRUE(words.holds(Cells{1, 2}));
    EXPECT_FALSE(words.holds(Cells{1}));
    const Verification bit = of({22, 0, 9, 0xff, 0xfb, 0, 4});
    EXPECT_TRUE(bit.holds(Cells{0xfff4})) << "a mask looks at its bits only";
    EXPECT_FALSE(bit.holds(Cells{0xfff0}));
    EXPECT_FALSE(Verification::of(modbus::Request::read({Table::coils, 0, 1})));
}

/// Panels that store what is written to them: registers by station and address.
class ApiVerify : public HttpRig {
  protected:
    ApiVerify() {
        bus.script = [this](const bus::Request& request) { return answer(request); };
    }
    bus::Answer answer(const bus::Request& request) {
        if (request.request.is_read()) {
            if (mute) return test::FakeBus::fault(Fault::timeout, true);
            Writer out;
            const auto span = *request.request.span();
            out.u8(3).u8(2 * span.count);
            for (unsigned i = 0; i < span.count; ++i)
                out.u16(memory[{request.station, span.first + i}]);
            return test::FakeBus::reply(out.take());
        }
        const Bytes& pdu = request.request.pdu();
        const auto value = static_cast<std::uint16_t>(pdu[3] << 8 | pdu[4]);
        for (const int station : {5, 31}) {
            if (keeps && (request.station == station || request.station == 0))
                memory[{station, pdu[2]}] = value;
        }
        if (lost) return test::FakeBus::fault(Fault::timeout, true);
        return test::FakeBus::reply(pdu);
    }
    Reply put(const std::string& body) {
        return ask("PUT", "/api/v1/stations/press/devices/UW7", body);
    }
    Reply broadcast() {
        return ask("POST", "/api/v1/lines/floor1/broadcast",
                   R"({"table":"holding-registers","address":7,"values":[9],"verify":true})");
    }

    std::map<std::pair<int, unsigned>, std::uint16_t> memory;
    bool keeps = true;
    bool lost = false;
    bool mute = false;
};
constexpr const char* kNine = R"({"values":[9],"verify":true})";

TEST_F(ApiVerify, ReadsBackWhatWasWrittenAndTellsWhatIsThereInstead) {
    EXPECT_EQ(put(kNine).json(),
              json_of(R"({"transmitted":true,"confirmed":true,"verified":true})"));
    ASSERT_EQ(bus.requests.size(), 2u);
    EXPECT_EQ(last_pdu(), "03 00 07 00 01");
    EXPECT_EQ(put(R"({"values":[9]})").json().count("verified"), 0u);
    EXPECT_EQ(put(R"({"values":[9],"verify":1})").status(), 400u);
    keeps = false;
    memory.clear();
    EXPECT_EQ(put(kNine).json(),
              json_of(R"({"transmitted":true,"confirmed":true,"verified":false,"read_back":[0]})"));
}

TEST_F(ApiVerify, P2TellsWhatBecameOfAWriteWhoseAnswerIsLost) {
    lost = true;
    EXPECT_EQ(status_and(put(kNine), "transmitted verified"), "504 true true");
    mute = true;
    EXPECT_EQ(status_and(put(kNine), "verified verify_detail"),
              "504 null the station did not answer in time");
}

TEST_F(ApiVerify, OfMemoryThatCannotBeReadIsRefusedBeforeItIsWritten) {
    std::erase_if(panel.functions, [](const auto& rule) { return rule.code == 3; });
    EXPECT_EQ(status_and(put(kNine), "rule"), "422 function");
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiVerify, OfABroadcastAsksEachStation) {
    add_meter();
    bus.rights = {};
    EXPECT_EQ(broadcast().json(), json_of(R"({"transmitted":true,"confirmed":true,"stations":[
        {"station":"press","verified":true},{"station":"meter","verified":true}]})"));
    keeps = false;
    memory[{5, 7}] = 8;
    const Reply some = broadcast();
    EXPECT_EQ(some.at("confirmed"), false);
    EXPECT_EQ(some.at("stations"), json_of(R"([{"station":"press","verified":true},
        {"station":"meter","verified":false,"read_back":[8]}])"));
    mute = true;
    EXPECT_EQ(broadcast().at("confirmed"), false);
}

}  // namespace
}  // namespace panelgate::web::write_test
