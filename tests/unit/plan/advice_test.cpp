#include "panelgate/plan/advice.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "plant_line.hpp"

namespace panelgate::plan::advice_test {
namespace {

using test::kRegisters;
using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class AdviceTest : public testing::Test, protected test::PlantLine {
  protected:
    std::vector<Advice> advice() const { return advise(line, make_plan(line)); }
    std::vector<std::string> warned() const { return warnings(line, make_plan(line)); }
    static double factor(const Advice& all) {
        return std::stod(all.what.substr(std::string_view("all intervals ").size()));
    }
    /// Returns the advice that starts like this; empty if there is none.
    Advice find(const std::string& start) const {
        for (const Advice& one : advice()) {
            if (one.what.starts_with(start)) return one;
        }
        return {};
    }
    /// Returns what one relay would be advised instead of, after `change`, which is then undone.
    template <class Change>
    std::string merged_after(Change change) {
        const Line before = line;
        change();
        std::string what = find("one relay instead of ").what;
        line = before;
        return what;
    }
};

TEST_F(AdviceTest, TheLowestRateThatIsEnoughIsToldIfAllPanelsHaveIt) {
    Station& press = add("press");
    ask(press, 0, 10, 1s);
    EXPECT_THAT(advice(), IsEmpty()) << "a line that is fine needs none";
    press.asked.clear();
    ask(press, 0, 100, 200ms);
    const Advice rate = find("serial: {baud: 19200}");
    EXPECT_NEAR(rate.load, make_plan(at_rate(line, 19200)).load, 1e-12);
    EXPECT_LT(rate.load, kHigh);
    profile::PanelProfile slow = *shipped.find("generic");
    slow.serial.baud = {9600};
    add("old").profile = &slow;
    EXPECT_THAT(find("serial").what, IsEmpty());
}

TEST_F(AdviceTest, WhereNoPollAloneIsEnoughAllIntervalsAreUpToADay) {
    for (const char* name : {"a", "b", "c", "d"}) ask(add(name), 0, 100, 600ms);
    EXPECT_THAT(find("read").what, IsEmpty());
    const Advice all = find("all intervals ");
    EXPECT_LE(all.load, kHigh);
    EXPECT_GT(all.load, 0.7);
    line.stations.clear();
    ask(add("press"), 0, 100, 150ms);
    ask(line.stations[0], 5000, 1, 24h);
    EXPECT_THAT(find("all intervals ").what, HasSubstr("(24h at most)"));
}

TEST_F(AdviceTest, AFactorOfManyHundredsIsFoundToo) {
    add_both();
    ask(line.stations[0], 0, 125, 600us);
    copy(500, 20, 50ms).refresh = 60s;  // it stays
    const Advice all = find("all intervals ");
    ASSERT_THAT(all.what, Not(IsEmpty()));
    EXPECT_GT(factor(all), make_plan(line).load / kHigh);
    EXPECT_GT(factor(all), 500);
    EXPECT_LE(all.load, kHigh);
}

TEST_F(AdviceTest, ARefreshIsNoInterval) {
    line.serial.baud = 1200;
    add_both();
    copy(0, 20, 100ms).refresh = 2s;
    ASSERT_EQ(verdict(make_plan(line)), Verdict::overload);
    ASSERT_TRUE(is_high_by_changes(make_plan(at_rate(line, 9600))));
    EXPECT_THAT(find("serial: ").what, HasSubstr("19200")) << "neither figure is too high then";
    const Advice all = find("all intervals ");
    EXPECT_THAT(all.what, HasSubstr("times as long (refresh as it is)"));
    line.relays[0].every = std::chrono::round<std::chrono::microseconds>(factor(all) * 100ms);
    EXPECT_NEAR(all.load, make_plan(line).load, 1e-6);
    EXPECT_EQ(verdict(make_plan(line)), Verdict::fine);
}

TEST_F(AdviceTest, WhatIsTooMuchWhileValuesChangeIsJudgedByThat) {
    line.serial = {.baud = 1200, .parity = Parity::even};
    add_both();
    copy(0, 100, 1s).refresh = 60s;
    line.relays[0].from.reset();  // on another line
    ASSERT_TRUE(is_high_by_changes(make_plan(line)));
    ASSERT_THAT(advice(), Not(IsEmpty()));
    const Advice rate = find("serial: {baud: 4800}");
    EXPECT_NEAR(rate.most, make_plan(at_rate(line, 4800)).most, 1e-9) << "2400 is not enough";
    for (const Advice& one : advice()) EXPECT_LE(one.most, kFull) << one.what;
}

TEST_F(AdviceTest, WhatBringsTheMostIsToldFirstAndWhatBringsNothingIsNot) {
    add("press").think_time = 3s;
    ask(line.stations[0], 0, 1, 1s);
    const std::vector<Advice> all = advice();
    ASSERT_GT(all.size(), 1u);
    EXPECT_TRUE(std::ranges::is_sorted(all, {}, &Advice::load));
    EXPECT_LT(all[0].load, kHigh);
    line.serial.baud = 57600;
    EXPECT_THAT(find("serial").what, IsEmpty()) << "less than one percent";
    line.serial.baud = 115200;
    line.stations.clear();
    ask(add("press"), 0, 100, 12ms);
    for (const Advice& one : advice()) EXPECT_LT(one.load, make_plan(line).load) << one.what;
    EXPECT_THAT(advice(), Not(IsEmpty()));
    EXPECT_THAT(find("serial").what, IsEmpty()) << "there is no higher rate";
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

TEST_F(WarningsTest, PanelsThatAreAlikeAreToldTogetherAndARelayIsARequestToo) {
    add("from");
    for (const char* name : {"a", "b", "c", "d", "e"}) {
        Station& one = add(name);
        one.think_time = 3s;
        if (*name != 'a') ask(one, 0, 1, 60s);
    }
    copy(0, 4, 60s);  // to 'a'
    EXPECT_THAT(warned(), ElementsAre(HasSubstr("'a', 'b', 'c' and 2 more")));
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
                                            HasSubstr("queue: {deadline: "),
                                            HasSubstr("read at most 99 at once"))));
}

TEST_F(WarningsTest, WhatItSaysHelps) {
    line.serial.baud = 1200;
    Station& press = add("press");
    ask(press, 0, 100, 60s);
    ask(press, 500, 10, 60s);
    EXPECT_THAT(warned(), Not(IsEmpty()));
    const std::string text = warned()[0];
    const std::string word = "read at most ";
    ASSERT_THAT(text, HasSubstr(word));
    std::uint32_t& count = press.asked[0].want.span.count;
    count = static_cast<std::uint32_t>(std::stoul(text.substr(text.find(word) + word.size())));
    EXPECT_THAT(warned(), IsEmpty());
    ++count;
    EXPECT_THAT(warned(), Not(IsEmpty()));
    count = 100;
    ASSERT_THAT(text, HasSubstr("{deadline: 3s}"));
    line.deadline = 3s;
    EXPECT_THAT(warned(), IsEmpty());
}

TEST_F(WarningsTest, PointsThatAreReadTogetherCannotBeFewer) {
    line.deadline = 30ms;
    Station& press = add("press");
    ask(press, 0, 10, 60s);
    ask(press, 10, 10, 60s);
    EXPECT_THAT(warned(), ElementsAre(AllOf(HasSubstr("it misses"), Not(HasSubstr("at most")))));
}

}  // namespace
}  // namespace panelgate::plan::advice_test
