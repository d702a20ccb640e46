#include "http_rig.hpp"

namespace panelgate::web::write_test {
namespace {

using ::testing::HasSubstr;

class ApiWrite : public HttpRig {
  protected:
    Reply put(const std::string& path, const std::string& body) {
        return ask("PUT", "/api/v1/stations/" + path, body);
    }
};

TEST_F(ApiWrite, WritesOneRegisterByFunction06) {
    const Reply reply = put("press/holding-registers/100", R"({"values":[258]})");
    EXPECT_EQ(reply.status(), 200u);
    EXPECT_EQ(reply.json(), json_of(R"({"transmitted":true,"confirmed":true})"));
    EXPECT_EQ(last_pdu(), "06 00 64 01 02");
    EXPECT_FALSE(bus.requests[0].poll);
}

TEST_F(ApiWrite, WritesSeveralRegistersByOneFunction16) {
    EXPECT_EQ(put("press/holding-registers/0x64", R"({"values":[1,-1,65535]})").status(), 200u);
    EXPECT_EQ(last_pdu(), "10 00 64 00 03 06 00 01 ff ff ff ff");
}

TEST_F(ApiWrite, WritesBitsAsBooleansOrNumbers) {
    EXPECT_EQ(put("press/coils/1", R"({"values":[true]})").status(), 200u);
    EXPECT_EQ(last_pdu(), "05 00 01 ff 00");
    EXPECT_EQ(put("press/devices/UB180", R"({"values":[0]})").status(), 200u);
    EXPECT_EQ(last_pdu(), "05 01 20 00 00");
    EXPECT_EQ(put("floor1:9/coils/1", R"({"values":[1,false,true]})").status(), 200u);
    EXPECT_EQ(last_pdu(), "0f 00 01 00 03 01 05");
}

TEST_F(ApiWrite, WritesOneValueByAMultipleWriteWhereThePanelHasNoSingleOne) {
    std::erase_if(panel.functions, [](const auto& rule) { return rule.code == 6; });
    EXPECT_EQ(put("press/devices/UW2", R"({"values":[7]})").status(), 200u);
    EXPECT_EQ(last_pdu(), "10 00 02 00 01 02 00 07");
}

TEST_F(ApiWrite, NeverSplitsAWrite) {
    EXPECT_EQ(put("press/holding-registers/0", R"({"values":[1,2,3,4]})").status(), 200u);
    const Reply reply = put("press/holding-registers/0", R"({"values":[1,2,3,4,5]})");
    EXPECT_EQ(reply.status(), 422u);
    EXPECT_EQ(reply.at("detail"), "at most 4 values in one write; writes are not split");
    EXPECT_EQ(reply.at("rule"), "quantity");
    EXPECT_EQ(reply.at("transmitted"), false);
    EXPECT_EQ(bus.requests.size(), 1u);
}

TEST_F(ApiWrite, SaysWhichFunctionThePanelLacks) {
    const Reply reply = put("press/coils/0", R"({"values":[1,0]})");
    EXPECT_EQ(reply.status(), 422u);
    EXPECT_EQ(reply.at("detail"), "the panel has no function 0F for 2 of its coils");
}

TEST_F(ApiWrite, RefusesTablesThatCannotBeWritten) {
    for (const char* table : {"discrete-inputs", "input-registers"}) {
        const Reply reply = put(std::string("press/") + table + "/1", R"({"values":[1]})");
        EXPECT_EQ(reply.status(), 405u);
        EXPECT_EQ(reply.header("Allow"), "GET, HEAD");
    }
    EXPECT_EQ(put("press/devices/TM1", R"({"values":[1]})").status(), 405u);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiWrite, WritesAnInputAreaThroughTheOtherTableThatReachesIt) {
    EXPECT_EQ(put("press/devices/GDT3", R"({"values":[9]})").status(), 200u);
    EXPECT_EQ(last_pdu(), "06 00 03 00 09");
}

TEST_F(ApiWrite, KeepsToTheWritableRangeOfAnArea) {
    EXPECT_EQ(put("press/devices/UW499", R"({"values":[9]})").status(), 200u);
    const Reply reply = put("press/devices/UW499", R"({"values":[9,9]})");
    EXPECT_EQ(reply.status(), 422u);
    EXPECT_THAT(std::string(reply.at("detail").as_string()), HasSubstr("writable: UW0 to UW499"));
    panel.areas[0].writable.reset();
    EXPECT_EQ(put("press/devices/UW1", R"({"values":[9]})").status(), 422u);
    EXPECT_EQ(bus.requests.size(), 1u);
}

TEST_F(ApiWrite, RefusesAReadOnlyStation) {
    add_meter();
    EXPECT_EQ(put("meter/coils/1", R"({"values":[1]})").status(), 403u);
    EXPECT_EQ(put("floor1:5/coils/1", R"({"values":[1]})").status(), 403u);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiWrite, RefusesValuesThatDoNotFit) {
    for (const char* body :
         {R"({"values":[65536]})", R"({"values":[-32769]})", R"({"values":[1.5]})",
          R"({"values":["1"]})", R"({"values":[true]})", R"({"values":[]})", R"({"values":7})",
          R"({"value":7,"values":[7]})", "{}", "[1]", "", "{",
          R"({"values":[18446744073709551615]})", R"({"values":[1e999]})"}) {
        EXPECT_EQ(put("press/holding-registers/1", body).status(), 400u) << body;
    }
    EXPECT_EQ(put("press/coils/1", R"({"values":[2]})").status(), 400u);
    EXPECT_EQ(put("press/holding-registers/65535", R"({"values":[1,2]})").status(), 422u);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiWrite, TakesOneValueWithoutAList) {
    EXPECT_EQ(put("press/devices/UW100", R"({"value":-2})").status(), 200u);
    EXPECT_EQ(last_pdu(), "06 00 64 ff fe");
}

TEST_F(ApiWrite, WritesTypesByTheirOrder) {
    EXPECT_EQ(put("press/devices/UW100", R"({"value":21.5,"type":"f32"})").status(), 200u);
    EXPECT_EQ(last_pdu(), "10 00 64 00 02 04 41 ac 00 00");
    const char* two = R"({"values":[21.5,-1],"type":"f32","order":"CDAB"})";
    EXPECT_EQ(put("press/devices/UW100", two).status(), 200u);
    EXPECT_EQ(last_pdu(), "10 00 64 00 04 08 00 00 41 ac 00 00 bf 80");
    EXPECT_EQ(put("press/holding-registers/100", R"({"value":"AB","type":"string"})").status(),
              200u);
    EXPECT_EQ(last_pdu(), "06 00 64 41 42");
}

TEST_F(ApiWrite, RefusesTypesThatDoNotFit) {
    for (const char* body :
         {R"({"value":1e39,"type":"f32"})", R"({"value":70000,"type":"u16"})",
          R"({"value":1,"type":"f33"})", R"({"value":1,"type":"f32","order":"XY"})",
          R"({"value":"AB","type":"f32"})", R"({"value":1,"length":3})"}) {
        const unsigned status = put("press/holding-registers/1", body).status();
        EXPECT_TRUE(status == 400 || status == 422) << body << " " << status;
    }
    EXPECT_TRUE(bus.requests.empty());
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
}

TEST_F(ApiWrite, PointsAtTheMistakeInABody) {
    const Reply reply = put("press/coils/1", "{\"values\":\n  [1,]}");
    EXPECT_EQ(reply.status(), 400u);
    EXPECT_THAT(std::string(reply.at("detail").as_string()), HasSubstr("line 2, column 6"));
    EXPECT_THAT(std::string(put("press/coils/1", "{} x").at("detail").as_string()),
                HasSubstr("line 1, column 4"));
}

TEST_F(ApiWrite, P2TellsAWriteWithoutAnAnswerFromOneThatNeverLeft) {
    bus.script = [](const bus::Request&) { return test::FakeBus::fault(Fault::timeout, true); };
    const Reply unknown = put("press/coils/1", R"({"values":[1]})");
    EXPECT_EQ(unknown.status(), 504u);
    EXPECT_EQ(unknown.at("transmitted"), true);
    bus.script = [](const bus::Request&) { return test::FakeBus::fault(Fault::offline, false); };
    EXPECT_EQ(put("press/coils/1", R"({"values":[1]})").at("transmitted"), false);
    EXPECT_EQ(bus.requests.size(), 2u);
}

TEST_F(ApiWrite, GivesAPanelsExceptionToAWrite) {
    bus.script = [](const bus::Request&) { return test::FakeBus::reply({0x86, 3}); };
    const Reply reply = put("press/holding-registers/1", R"({"values":[1]})");
    EXPECT_EQ(reply.status(), 422u);
    EXPECT_EQ(reply.at("modbus_exception"), 3);
}

}  // namespace
}  // namespace panelgate::web::write_test
