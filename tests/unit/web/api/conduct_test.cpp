#include "conduct.hpp"

#include "answer.hpp"
#include "http_rig.hpp"

namespace panelgate::web::conduct_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using ApiManners = HttpRig;

TEST(Tag, DoesNotCountWhatOnlyTimeChanges) {
    EXPECT_EQ(tag_of(R"({"a":1,"age_ms":5})"), tag_of(R"({"a":1,"age_ms":17})"));
    EXPECT_NE(tag_of(R"({"a":1,"age_ms":5})"), tag_of(R"({"a":2,"age_ms":5})"));
    EXPECT_NE(tag_of(R"({"a":1,"age_ms":5,"b":1})"), tag_of(R"({"a":1,"age_ms":5,"b":2})"));
    EXPECT_THAT(tag_of(""), StartsWith("W/\""));
}

TEST(Tag, IsFoundInAListStrongOrWeak) {
    EXPECT_TRUE(names_tag("W/\"7\"", "W/\"7\""));
    EXPECT_TRUE(names_tag("\"7\"", "W/\"7\""));
    EXPECT_TRUE(names_tag("\"6\", W/\"7\", \"8\"", "W/\"7\""));
    EXPECT_TRUE(names_tag("*", "W/\"7\""));
    EXPECT_FALSE(names_tag("", "W/\"7\""));
    EXPECT_FALSE(names_tag("\"77\"", "W/\"7\""));
}

TEST_F(ApiManners, P10StatusThatHasNotChangedIsNotSentAgain) {
    bus.stations[31].last_success = 5ms;
    const Reply first = get("/api/v1/stations");
    const std::string tag = first.header("ETag");
    bus.stations[31].last_success = 80ms;
    const Reply same = ask("GET", "/api/v1/stations", "", "If-None-Match: " + tag + "\r\n");
    EXPECT_EQ(same.status(), 304u);
    EXPECT_EQ(same.header("ETag"), tag);
    EXPECT_EQ(same.body(), "");
    bus.stations[31].state = Health::offline;
    const Reply other = ask("GET", "/api/v1/stations", "", "If-None-Match: " + tag + "\r\n");
    EXPECT_EQ(other.status(), 200u);
    EXPECT_NE(other.header("ETag"), tag);
    EXPECT_EQ(get("/api/v1/stations/press/coils/1").header("ETag"), "");
}

TEST_F(ApiManners, WhatIsLongerThanAPacketIsPackedForWhoeverTakesIt) {
    const std::string path = "/api/v1/stations/floor1:9/holding-registers/0?count=";
    const Reply packed = ask("GET", path + "2000", "", "Accept-Encoding: gzip\r\n");
    EXPECT_EQ(packed.header("Content-Encoding"), "gzip");
    EXPECT_EQ(packed.header("Vary"), "Accept-Encoding");
    EXPECT_THAT(packed.body(), StartsWith("\x1f\x8b"));
    const Reply plain = get(path + "2000");
    EXPECT_EQ(plain.header("Content-Encoding"), "");
    EXPECT_EQ(plain.header("Vary"), "Accept-Encoding");
    EXPECT_LT(packed.body().size() * 2, plain.body().size());
    const Reply small = ask("GET", path + "2", "", "Accept-Encoding: gzip\r\n");
    EXPECT_EQ(small.header("Content-Encoding"), "");
}

TEST_F(ApiManners, APreferenceThatWasHeededIsSaid) {
    const std::string prefer = "Prefer: wait=1\r\n";
    const Reply reply = ask("GET", "/api/v1/stations/press/coils/1", "", prefer);
    EXPECT_EQ(reply.header("Preference-Applied"), "wait=1");
    EXPECT_EQ(ask("GET", "/api/v1/stations", "", prefer).header("Preference-Applied"), "");
    EXPECT_EQ(get("/api/v1/stations/press/coils/1").header("Preference-Applied"), "");
}

TEST_F(ApiManners, EveryPathTellsWhatItUnderstandsAndNothingToOtherSites) {
    const auto allow = [&](const std::string& path) {
        const Reply reply = ask("OPTIONS", path);
        EXPECT_EQ(reply.status(), 204u) << path;
        EXPECT_EQ(reply.header("Access-Control-Allow-Origin"), "");
        return reply.header("Allow");
    };
    EXPECT_EQ(allow("/api/v1/stations/press/devices/UW1"), "GET, HEAD, PUT, OPTIONS");
    EXPECT_EQ(allow("/api/v1/read"), "POST, OPTIONS");
    EXPECT_EQ(allow("/openapi.json"), "GET, HEAD, OPTIONS");
}

TEST(Csv, IsPreferredWhereItIsNamedAndWeighsNoLess) {
    EXPECT_FALSE(prefers_csv(""));
    EXPECT_FALSE(prefers_csv("*/*"));
    EXPECT_TRUE(prefers_csv("text/csv"));
    EXPECT_TRUE(prefers_csv("text/csv, */*;q=0.1"));
    EXPECT_TRUE(prefers_csv("application/json;q=0.5,text/csv;header=present; q=0.8"));
    EXPECT_FALSE(prefers_csv("application/json, text/csv;q=0.8"));
    EXPECT_FALSE(prefers_csv("text/csv;q=0"));
}

TEST(Csv, QuotesWhatHasCommasQuotesOrLines) {
    constexpr std::string_view columns[] = {"a", "b,c", "d", "e", "f"};
    EXPECT_EQ(csv_line(columns), "a,\"b,c\",d,e,f\r\n");
    const auto object =
        boost::json::parse(R"({"a":"x \"y\"","b,c":1.5,"d":null,"e":true})").as_object();
    EXPECT_EQ(csv_line(object, columns), "\"x \"\"y\"\"\",1.5,,true,\r\n");
}

}  // namespace
}  // namespace panelgate::web::conduct_test
