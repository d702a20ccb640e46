#include <gmock/gmock.h>

#include <string>
#include <string_view>
#include <vector>

#include "plant_line.hpp"

namespace panelgate::plan::advice_test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;

class AdviceTest : public testing::Test, protected test::PlantLine {
  protected:
    /// Returns what helps; empty if nothing is advised.
    Advice helps() const { return advise(line, make_plan(line)).value_or(Advice{}); }
    std::vector<std::string> warned() const { return warnings(line, make_plan(line)); }
    static double factor(const Advice& all) {
        return std::stod(all.what.substr(std::string_view("all intervals ").size()));
    }
    /// One panel does not have a higher rate.
    void keep_rate() {
        slow = *shipped.find("generic");
        slow.serial.baud = {line.serial.baud};
        add("old").profile = &slow;
    }

    profile::PanelProfile slow;
};

TEST_F(AdviceTest, TheLowestRateThatIsEnoughIsToldIfAllPanelsHaveIt) {
    Station& press = add("press");
    ask(press, 0, 10, 1s);
    EXPECT_THAT(helps().what, IsEmpty()) << "a line that is fine needs none";
    press.asked.clear();
    ask(press, 0, 100, 200ms);
    const Advice rate = helps();
    EXPECT_EQ(rate.what, "serial: {baud: 19200} (of all panels, too)");
    line.serial.baud = 19200;
    EXPECT_NEAR(rate.load, make_plan(line).load, 1e-12);
    EXPECT_LT(rate.load, kHigh);
    line.serial.baud = 9600;
    keep_rate();
    EXPECT_THAT(helps().what, HasSubstr("all intervals"));
}

TEST_F(AdviceTest, WhereNoRateIsEnoughAllIntervalsAreLonger) {
    for (const char* name : {"a", "b", "c", "d"}) ask(add(name), 0, 100, 600ms);
    keep_rate();
    const Advice all = helps();
    EXPECT_THAT(all.what, EndsWith(" times as long"));
    EXPECT_LE(all.load, kHigh);
    EXPECT_GT(all.load, 0.7);
    EXPECT_NEAR(all.load, make_plan(at_intervals(line, factor(all))).load, 1e-12);
}

TEST_F(AdviceTest, ARefreshIsNoInterval) {
    line.serial.baud = 1200;
    add_both();
    copy(0, 20, 100ms).refresh = 2s;
    ASSERT_EQ(verdict(make_plan(line)), Verdict::overload);
    keep_rate();
    const Advice all = helps();
    EXPECT_THAT(all.what, HasSubstr("times as long (refresh as it is)"));
    EXPECT_EQ(verdict(make_plan(at_intervals(line, factor(all)))), Verdict::fine);
    line.stations.pop_back();
    EXPECT_THAT(helps().what, HasSubstr("19200")) << "neither figure is too high then";
}

TEST_F(AdviceTest, WhatIsTooMuchWhileValuesChangeIsJudgedByThat) {
    line.serial = {.baud = 1200, .parity = Parity::even};
    add_both();
    copy(0, 100, 1s).refresh = 60s;
    line.relays[0].from.reset();  // on another line
    ASSERT_TRUE(is_high_by_changes(make_plan(line)));
    const Advice rate = helps();
    EXPECT_THAT(rate.what, HasSubstr("baud: 4800")) << "2400 is not enough";
    EXPECT_LE(rate.most, kFull);
}

TEST_F(AdviceTest, WhatNeitherRateNorIntervalsCureHasNone) {
    line.serial.baud = 115200;
    add("press");
    ask(line.stations[0], 0, 100, 10us);
    EXPECT_THAT(helps().what, IsEmpty());
}

using WarningsTest = AdviceTest;

TEST_F(WarningsTest, APanelThatThinksForLongerThanItIsWaitedForTimesOut) {
    Station& press = add("press");
    press.think_time = press.response_timeout = 500ms;
    EXPECT_THAT(warned(), IsEmpty()) << "nobody asks it";
    ask(press, 0, 1, 10s);
    EXPECT_THAT(warned(), ElementsAre(AllOf(HasSubstr("think_time 500ms of 'press'"),
                                            HasSubstr("response_timeout of 500ms"),
                                            HasSubstr("would time out"))))
        << "the silence that ends the request comes before";
    press.response_timeout += silent_interval(line.serial);
    EXPECT_THAT(warned(), IsEmpty());
}

TEST_F(WarningsTest, AStationThatRestsForLongerThanItIsAskedIsTold) {
    Station& inverter = add("inverter");
    ask(inverter, 0, 2, 1s);
    ask(inverter, 500, 2, 1s);
    inverter.station_gap = 400ms;
    EXPECT_THAT(warned(), IsEmpty());
    inverter.station_gap = 850ms;
    EXPECT_THAT(warned(), ElementsAre(AllOf(HasSubstr("'inverter' is busy for longer"),
                                            HasSubstr("ask it 1.8 times as seldom"))));
    inverter.station_gap = {};
    inverter.after_write = 2s;
    EXPECT_THAT(warned(), IsEmpty()) << "nobody writes";
    add("oven").after_write = 2s;
    copy(0, 1, 2s);
    EXPECT_THAT(warned(), ElementsAre(HasSubstr("'oven' is busy for longer")));
}

TEST_F(WarningsTest, PanelsAreToldTogetherAndARelayIsARequestToo) {
    add("from");
    for (const char* name : {"a", "b", "c", "d", "e"}) {
        Station& one = add(name);
        one.think_time = 3s;
        if (*name != 'a') ask(one, 0, 1, 60s);
    }
    copy(0, 4, 60s);  // to 'a'
    EXPECT_THAT(warned(), ElementsAre(HasSubstr("of 'a' (and of 4 more)")));
}

TEST_F(WarningsTest, APollThatMissesTheDeadlineBehindTheLongestOtherIsTold) {
    Station& press = add("press");
    ask(press, 0, 100, 60s);
    ask(press, 500, 50, 60s);
    const LinePlan plan = make_plan(line);
    ASSERT_EQ(plan.polls.size(), 2u);
    line.deadline = plan.polls[0].wire + plan.polls[1].wire;
    EXPECT_THAT(warned(), IsEmpty());
    line.deadline -= 1us;
    EXPECT_THAT(warned(), ElementsAre(AllOf(HasSubstr("poll of press R0 (count 100)"),
                                            HasSubstr("poll of press R500 (count 50)"),
                                            HasSubstr("queue: {deadline: "))));
}

TEST_F(WarningsTest, TheDeadlineThatIsToldIsEnough) {
    line.serial.baud = 1200;
    ask(add("press"), 0, 100, 60s);
    ask(line.stations[0], 500, 10, 60s);
    EXPECT_THAT(warned(), ElementsAre(HasSubstr("{deadline: 3s}")));
    line.deadline = 3s;
    EXPECT_THAT(warned(), IsEmpty());
}

}  // namespace
}  // namespace panelgate::plan::advice_test
