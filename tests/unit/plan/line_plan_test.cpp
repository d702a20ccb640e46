#include "panelgate/plan/line_plan.hpp"

#include <gmock/gmock.h>

#include <cstddef>
#include <optional>

#include "plant_line.hpp"

namespace panelgate::plan::line_plan_test {
namespace {

using testing::SizeIs;

class LinePlanTest : public testing::Test, protected test::PlantLine {
  protected:
    std::optional<HighestRate> rate() const { return highest_rate(line, make_plan(line)); }
};

TEST_F(LinePlanTest, APollCostsItsFramesItsSilencesAndTheThinkTime) {
    Station& press = add("press");
    press.think_time = 3ms;
    ask(press, 100, 10, 500ms);
    const LinePlan plan = make_plan(line);
    ASSERT_THAT(plan.polls, SizeIs(1));
    const Poll& poll = plan.polls[0];
    EXPECT_EQ(poll.station, "press");
    EXPECT_EQ(poll.read, "R100");
    EXPECT_EQ(poll.count, 10u);
    // 8 + 25 characters of 10 bits at 9600 bit/s: 34.375 ms; twice 3.5 of them; 3 ms
    EXPECT_NEAR(to_seconds(poll.wire), 0.034375 + 2 * 0.003645833 + 0.003, 1e-7);
    EXPECT_NEAR(plan.load, to_seconds(poll.wire) / 0.5, 1e-9);
    EXPECT_EQ(plan.once, poll.wire);
    press.frame_gap = silent_interval(line.serial) + 20ms;
    EXPECT_EQ(make_plan(line).once, poll.wire + 20ms) << "kept behind the reply only";
}

TEST_F(LinePlanTest, NeighboursAreOnePollAsTheyWillBe) {
    Station& press = add("press");
    ask(press, 12, 2, 1s);
    ask(press, 10, 2, 1s);
    const LinePlan plan = make_plan(line);
    ASSERT_THAT(plan.polls, SizeIs(1));
    EXPECT_EQ(plan.polls[0].read, "R10");
    EXPECT_EQ(plan.polls[0].count, 4u);
}

TEST_F(LinePlanTest, ARelayLoadsTheLinesOfItsEnds) {
    add_both();
    copy(0, 4, 1s);
    const LinePlan both = make_plan(line);
    ASSERT_THAT(both.relays, SizeIs(2));
    EXPECT_EQ(both.relays[0].request, RelayLoad::Request::read);
    EXPECT_EQ(both.relays[0].station, "from");
    EXPECT_EQ(both.relays[1].request, RelayLoad::Request::write);
    EXPECT_EQ(both.relays[1].station, "to");
    EXPECT_EQ(both.load, both.relays[0].load + both.relays[1].load);
    line.relays[0].refresh = 60s;
    const LinePlan plan = make_plan(line);
    const RelayLoad& write = plan.relays[1];
    EXPECT_EQ(write.every, 60s) << "where it waits for changes, only that is certain";
    EXPECT_NEAR(write.most, 60 * write.load, 1e-9);
    EXPECT_NEAR(plan.most - plan.load, write.most - write.load, 1e-9);
    line.relays[0].to.reset();  // on another line
    EXPECT_THAT(make_plan(line).relays, SizeIs(1));
    EXPECT_NEAR(make_plan(line).load, both.relays[0].load, 1e-12);
}

TEST_F(LinePlanTest, PollsThatAWriteMakesOldAreReadAgain) {
    add_both();
    Station& to = line.stations[1];
    show_as_written(to);
    ask(to, 0, 4, 10s);
    ask(to, 500, 4, 10s);
    copy(0, 4, 1s).refresh = 20s;
    const LinePlan plan = make_plan(line);
    ASSERT_THAT(plan.relays, SizeIs(3));
    const RelayLoad& again = plan.relays[2];
    EXPECT_EQ(again.request, RelayLoad::Request::reread);
    EXPECT_EQ(again.wire, plan.polls[1].wire) << "one of the two";
    EXPECT_NEAR(again.load, to_seconds(again.wire) / 20, 1e-9);
    EXPECT_NEAR(again.most, to_seconds(again.wire), 1e-9);
    line.relays[0].every = 50ms;
    line.relays[0].refresh.reset();
    EXPECT_NEAR(make_plan(line).relays[2].load, to_seconds(again.wire) * 4, 1e-9)
        << "four a second at most";
}

TEST_F(LinePlanTest, P4TheWorstDeadStationIsTheOneThatWasAskedLeast) {
    ask(add("press"), 0, 100, 500ms);
    ask(add("mixer"), 0, 1, 10s);
    line.stations[0].response_timeout = 700ms;
    const LinePlan plan = make_plan(line);
    ASSERT_TRUE(plan.dead);
    EXPECT_EQ(plan.dead->station, "mixer");
    EXPECT_NEAR(plan.dead->load, plan.polls[0].load + 0.05, 1e-9);
    EXPECT_NEAR(to_seconds(plan.dead->holds), 0.7 + 0.008333333 + 0.003645833, 1e-7)
        << "press may fall silent as well";
}

TEST_F(LinePlanTest, P4WhereTheWholeLineRestsTheOthersWaitForThatToo) {
    ask(add("press"), 0, 100, 500ms);
    const Duration alone = make_plan(line).dead->holds;
    line.stations[0].line_rest = 5s;
    EXPECT_EQ(make_plan(line).dead->holds, 2 * alone + Duration(5s)) << "and is asked again";
    line.stations[0].repeats = false;
    EXPECT_EQ(make_plan(line).dead->holds, alone + Duration(5s));
}

TEST_F(LinePlanTest, WhatIsLeftIsForClients) {
    const LinePlan empty = make_plan(line);  // no stations
    EXPECT_EQ(empty.load, 0);
    EXPECT_FALSE(empty.dead);
    EXPECT_GT(empty.free_reads(), 10);
    Station& press = add("press");
    const LinePlan idle = make_plan(line);
    EXPECT_NEAR(idle.free_reads(), 1 / to_seconds(idle.client_read), 1e-9);
    ask(press, 0, 10, 2 * idle.client_read);
    const LinePlan half = make_plan(line);
    EXPECT_NEAR(half.load, 0.5, 1e-6);
    EXPECT_NEAR(half.free_reads(), idle.free_reads() / 2, 1e-3);
    press.asked.clear();
    line.listens = true;
    const LinePlan listening = make_plan(line);
    EXPECT_FALSE(listening.dead) << "nobody holds it up";
    EXPECT_EQ(listening.free_share(), 0);
    EXPECT_EQ(listening.free_reads(), 0);
}

TEST_F(LinePlanTest, WhatIsTooMuchIsToldAndChangesAloneAreNoOverload) {
    add_both();
    const Duration wire = make_plan(line).client_read;
    const auto verdict_at = [&](Duration every) {
        line.stations[0].asked.clear();
        ask(line.stations[0], 0, 10, every);
        return verdict(make_plan(line));
    };
    EXPECT_EQ(verdict_at(wire * 100 / 79), Verdict::fine);
    EXPECT_EQ(verdict_at(wire * 100 / 81), Verdict::high);
    EXPECT_EQ(verdict_at(wire * 100 / 101), Verdict::overload);
    line.stations[0].asked.clear();
    copy(0, 50, 150ms).refresh = 60s;
    const LinePlan plan = make_plan(line);
    EXPECT_GT(plan.most, 1);
    EXPECT_LT(plan.load, 1);
    EXPECT_EQ(verdict(plan), Verdict::high);
}

TEST_F(LinePlanTest, AnotherRateTakesTheGapsAlongThatAreNotSet) {
    add("standard");
    add("panasonic", "panasonic-gt");
    add("slow").frame_gap = 20ms;
    for (Station& station : line.stations) ask(station, 0, 1, 1s);
    line.serial.baud = 19200;
    const LinePlan plan = make_plan(line);
    const auto gap_beyond_standard = [&](std::size_t poll) {
        return to_seconds(plan.polls[poll].wire - plan.polls[0].wire);
    };
    const double standard = to_seconds(silent_interval(line.serial));
    EXPECT_NEAR(gap_beyond_standard(1), 4 * 10.0 / 19200 - standard, 1e-7);
    EXPECT_NEAR(gap_beyond_standard(2), 0.02 - standard, 1e-7);
}

TEST_F(LinePlanTest, OtherIntervalsLeaveTheRefreshAndEndAtADay) {
    add_both();
    ask(line.stations[0], 0, 1, 13h);
    copy(0, 4, 1s).refresh = 2s;
    const Line rarer = at_intervals(line, 3);
    EXPECT_EQ(rarer.stations[0].asked[0].want.every, 24h);
    EXPECT_EQ(rarer.relays[0].every, 3s);
    EXPECT_EQ(rarer.relays[0].writes_every(), 3s);
    EXPECT_EQ(rarer.relays[0].refresh, 2s);
}

TEST_F(LinePlanTest, PollsCanGoUpToEightyPercent) {
    Station& press = add("press");
    EXPECT_FALSE(rate()) << "an idle line has no highest rate";
    ask(press, 0, 10, 2 * make_plan(line).client_read);
    ASSERT_TRUE(rate());
    EXPECT_NEAR(rate()->times, 1.6, 1e-5);
    EXPECT_FALSE(rate()->changing);
}

TEST_F(LinePlanTest, TheHighestRateIsSlowerWhereChangesAreTooMuch) {
    add_both();
    copy(0, 50, 150ms).refresh = 60s;
    ASSERT_GT(make_plan(line).most, 1);
    ASSERT_TRUE(rate());
    EXPECT_LT(rate()->times, 1);
    EXPECT_TRUE(rate()->changing);
    EXPECT_NEAR(make_plan(at_intervals(line, 1 / rate()->times)).most, kFull, 1e-4);
}

}  // namespace
}  // namespace panelgate::plan::line_plan_test
