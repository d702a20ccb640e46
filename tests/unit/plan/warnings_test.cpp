#include "panelgate/plan/advice.hpp"

#include <gmock/gmock.h>

#include "plant_line.hpp"

namespace panelgate::plan::warnings_test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class WarningsTest : public testing::Test, protected test::PlantLine {
  protected:
    std::vector<std::string> told() const { return warnings(line, make_plan(line)); }
};

TEST_F(WarningsTest, WhatAnswersInTimeAndFitsIsFine) {
    ask(add("press"), 0, 100, 200ms);
    EXPECT_THAT(told(), IsEmpty());
}

TEST_F(WarningsTest, APanelThatThinksForLongerThanItIsWaitedForTimesOut) {
    Station& press = add("press");
    ask(press, 0, 1, 10s);
    press.think_time = press.response_timeout = 500ms;
    EXPECT_THAT(told(), ElementsAre(AllOf(HasSubstr("think_time 500ms of 'press'"),
                                          HasSubstr("response_timeout of 500ms"),
                                          HasSubstr("would time out"))))
        << "the silence that ends the request comes before";
    line.stations[0].response_timeout += silent_interval(line.serial);
    EXPECT_THAT(told(), IsEmpty());
}

TEST_F(WarningsTest, OneThatNobodyAsksDoesNot) {
    add("press").think_time = 3s;
    EXPECT_THAT(told(), IsEmpty());
}

TEST_F(WarningsTest, PanelsThatAreAlikeAreToldTogether) {
    for (const char* name : {"a", "b", "c", "d", "e"}) {
        Station& one = add(name);
        one.think_time = 3s;
        ask(one, 0, 1, 60s);
    }
    EXPECT_THAT(told(), ElementsAre(HasSubstr("'a', 'b', 'c' and 2 more")));
}

TEST_F(WarningsTest, ARelayIsARequestToo) {
    add("from");
    add("to").think_time = 3s;
    copy(0, 4, 60s);
    EXPECT_THAT(told(), ElementsAre(HasSubstr("'to'")));
}

TEST_F(WarningsTest, APollThatMissesTheDeadlineBehindTheLongestOtherIsTold) {
    Station& press = add("press");
    ask(press, 0, 100, 60s);
    ask(press, 500, 50, 60s);
    const LinePlan plan = make_plan(line);
    ASSERT_EQ(plan.polls.size(), 2u);
    const Duration both = plan.polls[0].wire + plan.polls[1].wire;
    line.deadline = both;
    EXPECT_THAT(told(), IsEmpty());
    line.deadline = both - 1us;
    EXPECT_THAT(told(), ElementsAre(AllOf(HasSubstr("poll of press R0 (count 100)"),
                                          HasSubstr("poll of press R500 (count 50)"),
                                          HasSubstr("queue: {deadline: "),
                                          HasSubstr("read at most 99 at once"))));
}

TEST_F(WarningsTest, WhatItSaysHelps) {
    line.serial.baud = 1200;
    Station& press = add("press");
    ask(press, 0, 100, 60s);
    ask(press, 500, 10, 60s);
    EXPECT_THAT(told(), Not(IsEmpty()));
    const std::string text = told()[0];
    const std::string word = "read at most ";
    ASSERT_THAT(text, HasSubstr(word));
    Line fewer = line;
    fewer.stations[0].asked[0].want.span.count =
        static_cast<std::uint32_t>(std::stoul(text.substr(text.find(word) + word.size())));
    EXPECT_THAT(warnings(fewer, make_plan(fewer)), IsEmpty());
    ++fewer.stations[0].asked[0].want.span.count;
    EXPECT_THAT(warnings(fewer, make_plan(fewer)), Not(IsEmpty()));
    ASSERT_THAT(text, HasSubstr("{deadline: 3s}"));
    line.deadline = 3s;
    EXPECT_THAT(told(), IsEmpty());
}

TEST_F(WarningsTest, PointsThatAreReadTogetherCannotBeFewer) {
    line.deadline = 30ms;
    Station& press = add("press");
    ask(press, 0, 10, 60s);
    ask(press, 10, 10, 60s);
    EXPECT_THAT(told(), ElementsAre(AllOf(HasSubstr("it misses"), Not(HasSubstr("at most")))));
}

}  // namespace
}  // namespace panelgate::plan::warnings_test
