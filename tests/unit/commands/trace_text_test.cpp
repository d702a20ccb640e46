// Traces and reports.
#include "trace_text.hpp"

#include <gmock/gmock.h>

#include <boost/json/parse.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::commands::trace_text_test {
namespace {

using ::testing::HasSubstr;

constexpr std::string_view kPage = R"({"transactions":[
    {"time":"2026-11-26T01:42:45.3Z","station":31,"reason":"read","client":"http 127.0.0.1",
     "outcome":"ok","arrived":1.0,"answered":1.007,"request":"1F 03","reply":"1F 03 02"},
    {"time":"2026-11-26T01:42:47.3Z","station":5,"reason":"poll","client":"poll of mixer",
     "outcome":"timeout","arrived":1.0,"answered":null,"request":"05 03","reply":null}],
    "decisions":[{"time":"2026-11-26T01:42:46.3Z","text":"poll of press refused: offline"},
    {"time":"2026-11-26T01:42:46.4Z","text":"write of http to station 5 refused: offline"}]})";

std::string all(const TraceFilter& filter) {
    const auto page = boost::json::parse(kPage).as_object();
    std::string text;
    for (const TraceLine& line : trace_lines(page, filter, {{31, "press"}})) text += line.text;
    return text;
}

TEST(TraceLines, AreInTheOrderOfTime) {
    EXPECT_EQ(
        trace_heading() + all({}),
        "TIME                        STATION      WHY    OUTCOME       TOTAL  CLIENT           "
        "   FRAMES\n"
        "2026-11-26T01:42:45.3Z      press        read   ok           7.0 ms  http 127.0.0.1   "
        "   > 1F 03  < 1F 03 02\n"
        "2026-11-26T01:42:46.3Z      poll of press refused: offline\n"
        "2026-11-26T01:42:46.4Z      write of http to station 5 refused: offline\n"
        "2026-11-26T01:42:47.3Z      5            poll   timeout           -  poll of mixer    "
        "   > 05 03\n");
}

TEST(TraceLines, AreOfAStationOrOfErrors) {
    EXPECT_EQ(all({.station = 31, .name = "press", .errors = true}),
              "2026-11-26T01:42:46.3Z      poll of press refused: offline\n");
    const std::string mixer = all({.station = 5, .name = "", .errors = false});
    EXPECT_THAT(mixer, HasSubstr("station 5 refused"));
    EXPECT_THAT(mixer, HasSubstr("> 05 03"));
    EXPECT_EQ(mixer.find("press"), std::string::npos);
}

TEST(ReportText, IsJsonWithoutPasswords) {
    const std::string text = report_text({{"time", "now", false},
                                          {"lines/a", R"({"x":1.50})", true},
                                          {"lines/b", "[1]\n", true},
                                          {"trace/a", "", true},
                                          {"mqtt", "mqtt://u:p@w@host:1/x", false},
                                          {"mail", "to a@b, see http://host/@", false}});
    EXPECT_THAT(text, HasSubstr(R"("a":{"x":1.50})"));
    const auto value = boost::json::parse(text);
    EXPECT_EQ(value.at("time").as_string(), "now");
    EXPECT_EQ(value.at("lines").at("b"), boost::json::parse("[1]"));
    EXPECT_EQ(value.at("trace").at("a").as_string(), "");
    EXPECT_EQ(value.at("mqtt").as_string(), "mqtt://host:1/x");
    EXPECT_EQ(value.at("mail").as_string(), "to a@b, see http://host/@");
    EXPECT_EQ(boost::json::parse(report_text({{"a/b", "c", false}})).at("a").at("b").as_string(),
              "c");
}

}  // namespace
}  // namespace panelgate::commands::trace_text_test
