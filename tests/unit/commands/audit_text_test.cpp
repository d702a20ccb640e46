#include "audit_text.hpp"

#include <gtest/gtest.h>

#include <boost/json/parse.hpp>
#include <chrono>
#include <string>

namespace panelgate::commands::audit_text_test {
namespace {

namespace json = boost::json;

json::object record(const std::string& members) {
    return json::parse(R"({"n":17,"time":"2026-11-26T09:00:00.123Z",)" + members +
                       R"(,"hash":"x"})")
        .as_object();
}

const std::string kWrite =
    R"("kind":"write","client":"http 10.0.0.7 token ops","face":"http","token":"ops",)"
    R"("role":"operator","line":"floor1","station":"press","id":31,"at":"UW102","function":6,)"
    R"("table":"holding-registers","address":102,"count":1,"values":[21],"before":[20],)"
    R"("before_age_ms":120,"outcome":"confirmed","transaction":42)";

TEST(AuditLine, SaysWhatWasWrittenByWhom) {
    EXPECT_EQ(audit_line(record(kWrite)),
              "2026-11-26T09:00:00.123Z  17 write  press UW102 = 21 (was 20)  confirmed  "
              "http 10.0.0.7 token ops  role=operator  transaction=42");
}

TEST(AuditLine, SaysWhoRefusedIt) {
    EXPECT_EQ(
        audit_line(record(R"("kind":"write","client":"modbus_tcp 10.0.0.7:5","line":"a",)"
                          R"("id":0,"pdu":"41ff","outcome":"refused","rule":"access")")),
        "2026-11-26T09:00:00.123Z  17 write  a all stations pdu 41ff  refused by rule access  "
        "modbus_tcp 10.0.0.7:5");
    EXPECT_EQ(
        audit_line(record(R"("kind":"write","line":"a","id":7,"table":"coils","address":3,)"
                          R"("values":[1,0],"outcome":"refused","by":"panel","exception":2)")),
        "2026-11-26T09:00:00.123Z  17 write  a:7 coils/3 = 1, 0  refused by the panel, "
        "exception 2");
    EXPECT_EQ(audit_line(record(R"("kind":"repeats","count":9,"address":"10.0.0.7","token":"ops",)"
                                R"("station":"press","outcome":"not_sent","why":"offline")")),
              "2026-11-26T09:00:00.123Z  17 repeats  press  not sent: offline  9 times  10.0.0.7  "
              "token ops");
}

TEST(AuditLine, OtherKindsShowWhatTheyHave) {
    EXPECT_EQ(audit_line(record(R"("kind":"start","unclean":true,"version":"1.0.0")")),
              "2026-11-26T09:00:00.123Z  17 start  unclean=true  version=1.0.0");
    EXPECT_EQ(audit_line(record(R"("kind":"reload","cause":"SIGHUP","outcome":"applied",)"
                                R"("changes":["a","b"])")),
              "2026-11-26T09:00:00.123Z  17 reload  applied  cause=SIGHUP  changes=a, b");
}

TEST(AuditFilter, TakesWhatIsAskedFor) {
    const json::object one = record(kWrite);
    EXPECT_TRUE(is_shown(one, {}));
    EXPECT_TRUE(is_shown(one, {.station = "press",
                               .kind = "write",
                               .client = "ops",
                               .since = "2026-11-26T09:00:00.123Z"}));
    EXPECT_FALSE(is_shown(one, {.station = "mixer"}));
    EXPECT_FALSE(is_shown(one, {.kind = "login"}));
    EXPECT_FALSE(is_shown(one, {.client = "ivan"}));
    EXPECT_FALSE(is_shown(one, {.since = "2026-11-26T09:00:01"}));
    EXPECT_FALSE(is_shown(one, {.until = "2026-11-26"}));
}

TEST(AuditTime, IsASpanOrATime) {
    const WallTime now = std::chrono::sys_days(std::chrono::year(2026) / 11 / 26);
    EXPECT_EQ(audit_time("1h", now), "2026-11-25T23:00:00.000000Z");
    EXPECT_EQ(audit_time("7d", now), "2026-11-19T00:00:00.000000Z");
    EXPECT_EQ(audit_time("30min", now), "2026-11-25T23:30:00.000000Z");
    EXPECT_EQ(audit_time("2026-11-26T08:00:00Z", now), "2026-11-26T08:00:00");
    EXPECT_EQ(audit_time("2026-11-26T08:00:00.25+01:30", now), "2026-11-26T06:30:00.25");
    EXPECT_EQ(audit_time("2026-11-26", now), "2026-11-26");
    for (const char* wrong : {"", "h", "1", "1y", "-1h", "yesterday", "99999999999999999999h",
                              "2026-13-45", "2026-02-30T05:01:01Z", "2026-11-26T25:00:00Z",
                              "2026-11-26T16:00:00+99:99", "2026-11-26x", "2026-11-26T16"})
        EXPECT_EQ(audit_time(wrong, now), std::nullopt) << wrong;
    EXPECT_TRUE(audit_time("99999999w", now));
}

}  // namespace
}  // namespace panelgate::commands::audit_text_test
