// What status and top make of a gateway's answers.
#include "overview.hpp"

#include <gmock/gmock.h>

#include <boost/json/parse.hpp>
#include <string_view>

namespace panelgate::commands::overview_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

boost::json::object object(std::string_view text) { return boost::json::parse(text).as_object(); }

Overview well() {
    Overview made;
    made.url = "http://127.0.0.1:8080";
    made.lines.push_back(object(R"({"name":"floor1","device":"sim","state":"up","mode":"master",
        "up":true,"load_percent":99,"queue_depth":1,"findings":[],"clients":[]})"));
    made.stations = object(R"({"stations":[
        {"name":"press","line":"floor1","id":31,"profile":"autonics-gplp-s","state":"online",
         "last_success_ms":400},
        {"name":"io","line":"floor1","id":17,"profile":"autonics-arm","state":"unknown",
         "last_success_ms":null}]})");
    made.relays = object(R"({"relays":[{"name":"a to b","state":"ok"}]})");
    made.findings = object(R"({"findings":[]})");
    made.usage = object(R"({"lines":[{"line":"floor1","seconds":64,"load_percent":52.5,
        "requests":100,"errors":5,"no_turn":0,"transactions":90,"transaction_ms":10,
        "stations":[{"station":"press","requests":98,"errors":3,"no_turn":0,"transactions":90,
                     "transaction_ms":10}],
        "clients":[
        {"name":"poll of press","requests":9,"failed":0,"last_error":null,"last_error_ms":null,
         "percent":20.5},
        {"name":"10.0.0.7","requests":8,"failed":2,"last_error":"timeout","last_error_ms":3000,
         "percent":79.5}]}]})");
    return made;
}

TEST(StatusText, IsTwoTablesAndAVerdict) {
    EXPECT_EQ(status_text(well(), false),
              "http://127.0.0.1:8080, figures of the last minute\n"
              "\n"
              "LINE    STATE    LOAD  QUEUE  LATENCY    ERRORS  DEVICE\n"
              "floor1  up     52.5 %      1  10.0 ms  5 of 100  sim\n"
              "\n"
              "STATION  LINE/ID    PROFILE          STATE    LAST ANSWER  LATENCY   ERRORS\n"
              "press    floor1/31  autonics-gplp-s  online     0.4 s ago  10.0 ms  3 of 98\n"
              "io       floor1/17  autonics-arm     unknown        never        -   0 of 0\n"
              "\n"
              "all is well\n");
    EXPECT_THAT(troubles(well()), IsEmpty());
    Overview listening = well();
    listening.lines[0]["mode"] = "listen";
    listening.stations = object(R"({"stations":[{"name":"press","state":"heard"}]})");
    EXPECT_THAT(troubles(listening), IsEmpty());
    EXPECT_THAT(status_text(listening, false), HasSubstr("floor1  up, listening  52.5 %"));
}

TEST(StatusJson, HasTheSameForPrograms) {
    Overview overview = well();
    overview.not_ready = "modbus_tcp 10.0.0.1:502 does not listen";
    const boost::json::object made = boost::json::parse(status_json(overview)).as_object();
    EXPECT_EQ(made.at("ready"), boost::json::value(false));
    EXPECT_EQ(made.at("troubles").as_array().size(), 1U);
    EXPECT_EQ(made.at("lines").at(0).at("name"), boost::json::value("floor1"));
    EXPECT_EQ(made.at("stations").as_array().size(), 2U);
    EXPECT_TRUE(made.at("relays").is_array());
    EXPECT_TRUE(made.at("findings").is_array());
    EXPECT_EQ(made.at("usage").at(0).at("load_percent"), boost::json::value(52.5));
}

TEST(StatusText, NamesWhatIsNotWell) {
    Overview overview = well();
    overview.not_ready = "modbus_tcp 10.0.0.1:502 does not listen";
    overview.lines[0]["up"] = false;
    overview.lines[0]["state"] = "down";
    overview.lines[0]["findings"] = boost::json::parse(R"([{"cause":"station-silent","station":31,
        "name":"press","text":"It does not answer.","advice":"Look at its cable."},
        {"cause":"noise","station":null,"name":null,"text":"t","advice":"a"}])");
    overview.stations = object(R"({"stations":[{"name":"press","line":"floor1","id":31,
        "state":"offline","last_success_ms":240000},{"name":"io","line":"floor1","id":17,
        "state":"suspect","last_success_ms":null}]})");
    overview.relays = object(R"({"relays":[{"name":"a to b","state":"source failing: timeout"}]})");
    EXPECT_THAT(troubles(overview),
                ElementsAre("not ready: modbus_tcp 10.0.0.1:502 does not listen",
                            "line floor1 is down", "press is offline, its last answer is 4 min old",
                            "io is suspect, it has never answered", "press: station-silent",
                            "floor1: noise", "relay a to b: source failing: timeout"));
    const std::string text = status_text(overview, false);
    EXPECT_THAT(text, HasSubstr("press: station-silent\n  It does not answer.\n  Look at"));
    EXPECT_THAT(text, HasSubstr("not all is well:\n  not ready"));
    EXPECT_THAT(status_text(overview, true), HasSubstr("\x1b[1;31moffline\x1b[0m"));
}

TEST(StatusText, NamesWhatIsNotWellWithTheGatewayItself) {
    Overview overview = well();
    overview.findings = object(R"({"findings":[{"cause":"overload","line":"floor1","name":"floor1",
        "text":"Line floor1 is overloaded.","evidence":"asked by 10.0.0.7","advice":"Ask less."},
        {"cause":"audit-fails","line":null,"name":"/a.jsonl","text":"The audit cannot be written.",
        "evidence":"","advice":"Look at the disk."}]})");
    EXPECT_THAT(troubles(overview),
                ElementsAre("Line floor1 is overloaded.", "The audit cannot be written."));
    const std::string text = status_text(overview, false);
    EXPECT_THAT(text,
                HasSubstr("floor1: overload\n  Line floor1 is overloaded.\n  asked by 10.0.0.7\n"
                          "  Ask less.\n/a.jsonl: audit-fails\n  The audit cannot be "
                          "written.\n  Look at the disk.\n"));
    EXPECT_THAT(text, HasSubstr("not all is well:\n  Line floor1 is overloaded.\n  The audit"));
}

TEST(TopText, HasWhoUsesTheLineAndWhoIsSlow) {
    Overview overview = well();
    const std::string text = top_text(overview, false);
    EXPECT_THAT(text, HasSubstr("http://127.0.0.1:8080, figures of the last minute\n"));
    EXPECT_THAT(text, HasSubstr("floor1  up     52.5 %  [########        ]      1         1.6"
                                "       0.1  10.0 ms\n"));
    EXPECT_LT(text.find("10.0.0.7       floor1  79.5 %         8       2  timeout, 3.0 s ago"),
              text.find("poll of press"));
    EXPECT_THAT(text, HasSubstr("press    floor1/31  online  10.0 ms  3 of 98\n"));
    EXPECT_THAT(text, Not(HasSubstr("io ")));
    overview.usage.at("lines").at(0).as_object()["seconds"] = 34;
    EXPECT_THAT(top_text(overview, false), HasSubstr("figures of the last 34 s\n"));
}

}  // namespace
}  // namespace panelgate::commands::overview_test
