// What is printed of the gateway's answers.
#include "answers.hpp"

#include <gtest/gtest.h>

#include <boost/json/parse.hpp>
#include <string_view>

namespace panelgate::commands::answers_test {
namespace {

boost::json::object object(std::string_view text) { return boost::json::parse(text).as_object(); }

TEST(ValueText, IsShortest) {
    EXPECT_EQ(value_text(204.6), "204.6");
    EXPECT_EQ(value_text(true), "true");
    EXPECT_EQ(value_text(nullptr), "-");
    EXPECT_EQ(value_text(boost::json::parse("[1,2.5,\"a\\u001b\"]")), "1 2.5 a?");
    EXPECT_EQ(value_text(boost::json::parse("18446744073709551615")), "18446744073709551615");
}

TEST(ReadingText, NamesEachPlace) {
    EXPECT_EQ(reading_text(object(R"({"table":"holding-registers","address":108,
        "notation":"GDT108","values":[215],"age_ms":0,"source":"bus"})"),
                           ""),
              "GDT108  215\n");
    EXPECT_EQ(reading_text(object(R"({"table":"holding-registers","address":108,
        "notation":"GDT108","values":[1.5,-2],"age_ms":440,"source":"cache"})"),
                           "f32"),
              "GDT108                 1.5  read 0.4 s ago\n"
              "holding-registers/110  -2   read 0.4 s ago\n");
    EXPECT_EQ(reading_text(object(R"({"table":"holding-registers","address":0,"notation":"UW0",
        "notations":["UW0","UW2"],"values":[1.5,2.5]})"),
                           "f32"),
              "UW0  1.5\nUW2  2.5\n");
    EXPECT_EQ(reading_text(object(R"({"table":"coils","address":3,"values":[true]})"), ""),
              "coils/3  true\n");
}

TEST(PointText, SaysWhatIsNotGood) {
    const auto good = object(R"({"value":204.6,"unit":"celsius","quality":"good","age_ms":400})");
    EXPECT_EQ(point_text(good), "204.6 celsius");
    EXPECT_TRUE(is_good(good));
    EXPECT_EQ(point_line("oven/temperature", good),
              "oven/temperature  204.6 celsius, read 0.4 s ago\n");
    const auto stale = object(R"({"value":1,"label":"manual","unit":"","quality":"stale"})");
    EXPECT_EQ(point_text(stale), "1 (manual), stale");
    EXPECT_FALSE(is_good(stale));
    EXPECT_EQ(point_text(object(R"({"value":null,"unit":"celsius","quality":"bad"})")), "no value");
}

TEST(WrittenText, SaysWhetherItIsConfirmed) {
    const auto confirmed = object(R"({"transmitted":true,"confirmed":true,"value":1,
        "label":"manual"})");
    EXPECT_EQ(written_text("oven/mode", "manual", confirmed),
              "oven/mode = 1 (manual), confirmed\n");
    EXPECT_TRUE(is_confirmed(confirmed));
    EXPECT_EQ(written_text("oven GDT1", "5 6", object(R"({"transmitted":true,"confirmed":false})")),
              "oven GDT1 = 5 6, transmitted, not confirmed\n");
}

TEST(NotWrittenText, SaysWhatHasReachedThePanel) {
    EXPECT_EQ(not_written_text(object(R"({"detail":"no reply","transmitted":true})")),
              "no reply; it was transmitted, so it may be in effect");
    EXPECT_EQ(not_written_text(object(R"({"detail":"99 is above 60","transmitted":false})")),
              "99 is above 60; nothing was sent");
    EXPECT_EQ(not_written_text(object(R"({"detail":"nothing was sent: x","transmitted":false})")),
              "nothing was sent: x");
    EXPECT_EQ(not_written_text(object(R"({"title":"Bad Request"})")), "Bad Request");
}

TEST(NotWrittenText, HasNothingOfRest) {
    EXPECT_EQ(not_written_text(object(R"({"detail":"the nearest are 21.5 and 21.6; ?round=true )"
                                      R"(writes the nearest"})")),
              "the nearest are 21.5 and 21.6");
    EXPECT_EQ(not_written_text(object(R"({"detail":"a number that cannot be: line 1, column 10: )"
                                      R"(1e400 is beyond what a 64-bit number holds"})")),
              "1e400 is beyond what a 64-bit number holds");
}

TEST(EventCutter, TakesAnyPieces) {
    constexpr std::string_view kStream =
        ": panelgate\n\nretry: 2000\nid: 1\n\nid: 2\nevent: point\r\ndata: {\"a\":1}\r\n\r\n"
        "event: station\ndata:x\ndata: y\n\n";
    for (std::size_t size : {1U, 7U, 1000U}) {
        EventCutter cutter;
        std::vector<Event> all;
        for (std::size_t at = 0; at < kStream.size(); at += size) {
            for (Event& event : cutter.take(kStream.substr(at, size)))
                all.push_back(std::move(event));
        }
        ASSERT_EQ(all.size(), 2U);
        EXPECT_EQ(all[0].type, "point");
        EXPECT_EQ(all[0].data, "{\"a\":1}");
        EXPECT_EQ(all[1].data, "x\ny");
    }
}

}  // namespace
}  // namespace panelgate::commands::answers_test
