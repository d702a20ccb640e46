#include "panelgate/plan/advice.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <string_view>

#include "plant_line.hpp"

namespace panelgate::plan::advice_test {
namespace {

using test::kRegisters;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class AdviceTest : public testing::Test, protected test::PlantLine {
  protected:
    std::vector<Advice> advice() const { return advise(line, make_plan(line)); }
    static Duration rounded(std::chrono::duration<double, std::milli> every) {
        return std::chrono::round<std::chrono::microseconds>(every);
    }
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
};

TEST_F(AdviceTest, ALineThatIsFineNeedsNone) {
    ask(add("press"), 0, 10, 1s);
    EXPECT_THAT(advice(), IsEmpty());
}

TEST_F(AdviceTest, TheLowestRateThatIsEnoughIsTold) {
    ask(add("press"), 0, 100, 200ms);
    const Advice rate = find("serial: {baud: 19200}");
    EXPECT_NEAR(rate.load, make_plan(at_rate(line, 19200)).load, 1e-12);
    EXPECT_LT(rate.load, kHigh);
}

TEST_F(AdviceTest, ARateThatAPanelDoesNotHaveIsNotTold) {
    ask(add("press"), 0, 100, 200ms);
    profile::PanelProfile slow = *shipped.find("generic");
    slow.serial.baud = {9600};
    add("old").profile = &slow;
    EXPECT_THAT(find("serial").what, IsEmpty());
}

TEST_F(AdviceTest, ADearPollIsToldByItsStationWithAnIntervalThatIsEnough) {
    ask(add("press"), 0, 100, 250ms);
    ask(add("mixer"), 0, 1, 1s);
    const Advice slower = find("read press R0 (100) every ");
    EXPECT_THAT(slower.what, HasSubstr("every 300ms instead of 250ms"));
    EXPECT_LE(slower.load, kHigh);
    EXPECT_GT(slower.load, 0.7);
}

TEST_F(AdviceTest, WhereNoPollAloneIsEnoughAllIntervalsAre) {
    for (const char* name : {"a", "b", "c", "d"}) ask(add(name), 0, 100, 600ms);
    EXPECT_THAT(find("read").what, IsEmpty());
    const Advice all = find("all intervals ");
    EXPECT_LE(all.load, kHigh);
    EXPECT_GT(all.load, 0.7);
}

TEST_F(AdviceTest, RelaysThatGoOnWhereAnotherEndsCouldBeOne) {
    add("from");
    add("to");
    for (const std::uint32_t first : {4u, 0u, 8u}) copy(first, 4, 200ms);
    const Advice one = find("one relay instead of ");
    EXPECT_THAT(one.what, HasSubstr("copy4 and copy8"));
    EXPECT_THAT(one.what, HasSubstr("copy0 and copy4"));
    line.relays.clear();
    copy(0, 12, 200ms);
    EXPECT_NEAR(one.load, make_plan(line).load, 1e-9);
}

TEST_F(AdviceTest, RelaysThatDifferStayTwo) {
    add("from");
    add("to");
    copy(0, 4, 150ms);
    copy(4, 4, 150ms).to->span.first += 1;
    EXPECT_THAT(find("one relay").what, IsEmpty());
    line.relays[1].to->span.first -= 1;
    EXPECT_THAT(find("one relay").what, Not(IsEmpty()));
    line.relays[1].refresh = 60s;
    EXPECT_THAT(find("one relay").what, IsEmpty());
}

TEST_F(AdviceTest, RelaysThatNoWriteHoldsTogetherStayTwo) {
    add("from");
    add("to");
    copy(0, 100, 300ms);
    copy(100, 24, 300ms);
    EXPECT_THAT(find("one relay").what, IsEmpty());
}

TEST_F(AdviceTest, RelaysThatTheProfileKeepsApartStayTwo) {
    profile::PanelProfile parts = *shipped.find("generic");
    profile::Area whole = *parts.find_area(kRegisters, 500);
    parts.areas.clear();
    for (const std::uint32_t first : {0u, 504u}) {
        profile::Area& part = parts.areas.emplace_back(whole);
        part.readable = {first, first == 0 ? 503u : 9999u};
        part.writable = part.readable;
    }
    add("from");
    add("to").profile = &parts;
    copy(0, 4, 150ms);
    copy(4, 4, 150ms);
    EXPECT_THAT(find("one relay").what, IsEmpty());
    line.stations[1].profile = shipped.find("generic");
    EXPECT_THAT(find("one relay").what, Not(IsEmpty()));
}

TEST_F(AdviceTest, RelaysWhoseTargetIsReadOnStayTwo) {
    add("from");
    add("to");
    copy(0, 4, 150ms);
    copy(4, 4, 150ms);
    Relay& back = copy(500, 4, 150ms);
    back.from = Relay::End{1, {kRegisters, 500, 4}};
    back.to = Relay::End{0, {kRegisters, 4, 4}};
    EXPECT_THAT(find("one relay").what, IsEmpty()) << "it would be a circle";
}

TEST_F(AdviceTest, AllIntervalsAreLongEnoughWhereReadingAgainIsAtItsLimit) {
    add("from");
    Station& to = add("to");
    to.memory.shown_as = [](const modbus::Span& written) { return std::vector{written}; };
    ask(to, 500, 60, 2s);
    copy(0, 4, 50ms);
    const LinePlan now = make_plan(line);
    const Advice all = find("all intervals ");
    ASSERT_THAT(all.what, Not(IsEmpty()));
    EXPECT_GT(factor(all), now.load / kHigh + 0.2);
    EXPECT_NEAR(all.load, make_plan(at_intervals(line, factor(all))).load, 1e-9);
    EXPECT_LE(all.load, kHigh);
}

TEST_F(AdviceTest, ARefreshIsNoInterval) {
    line.serial.baud = 1200;
    add("from");
    add("to");
    copy(0, 20, 100ms).refresh = 2s;
    const Advice all = find("all intervals ");
    EXPECT_THAT(all.what, HasSubstr("times as long (refresh as it is)"));
    line.relays[0].every = rounded(factor(all) * 100ms);
    EXPECT_NEAR(all.load, make_plan(line).load, 1e-6);
    EXPECT_EQ(verdict(make_plan(line)), Verdict::fine);
}

TEST_F(AdviceTest, AFactorOfManyHundredsIsFoundToo) {
    add("from");
    add("to");
    ask(line.stations[0], 0, 125, 600us);
    copy(500, 20, 50ms).refresh = 60s;  // it stays
    const Advice all = find("all intervals ");
    ASSERT_THAT(all.what, Not(IsEmpty()));
    EXPECT_GT(factor(all), make_plan(line).load / kHigh);
    EXPECT_GT(factor(all), 500);
    EXPECT_LE(all.load, kHigh);
}

TEST_F(AdviceTest, AGapThatIsSetIsKeptAtAnotherRate) {
    line.serial.baud = 1200;
    add("press").frame_gap = 20ms;  // below t3.5, as tcp:// lines may have
    ask(line.stations[0], 0, 4, 50ms);
    const Advice rate = find("serial: {baud: ");
    EXPECT_THAT(rate.what, HasSubstr("{baud: 19200}"));
    line.serial.baud = 19200;
    EXPECT_NEAR(rate.load, make_plan(line).load, 1e-9);
    EXPECT_EQ(verdict(make_plan(line)), Verdict::fine);
}

TEST_F(AdviceTest, WhatIsTooMuchWhileValuesChangeIsJudgedByThat) {
    line.serial = {.baud = 1200, .parity = Parity::even};
    add("to");
    add("other");
    copy(0, 100, 1s).refresh = 60s;
    line.relays[0].from.reset();  // on another line
    line.relays[0].to->station = 0;
    const LinePlan now = make_plan(line);
    ASSERT_TRUE(is_high_by_changes(now));
    ASSERT_THAT(advice(), Not(IsEmpty()));
    const Advice rate = find("serial: {baud: 4800}");
    EXPECT_NEAR(rate.most, make_plan(at_rate(line, 4800)).most, 1e-9) << "2400 is not enough";
    for (const Advice& one : advice()) EXPECT_LE(one.most, kFull) << one.what;
}

TEST_F(AdviceTest, WhatHasTwoFiguresLeavesNeitherTooHigh) {
    line.serial.baud = 1200;
    add("from");
    add("to");
    copy(0, 20, 100ms).refresh = 2s;
    ASSERT_EQ(verdict(make_plan(line)), Verdict::overload);
    ASSERT_TRUE(is_high_by_changes(make_plan(at_rate(line, 9600))));
    EXPECT_THAT(find("serial: ").what, HasSubstr("19200"));
}

TEST_F(AdviceTest, WhatBringsTheMostIsToldFirst) {
    add("press").think_time = 3s;
    ask(line.stations[0], 0, 1, 1s);
    const std::vector<Advice> all = advice();
    ASSERT_GT(all.size(), 1u);
    EXPECT_TRUE(std::ranges::is_sorted(all, {}, &Advice::load));
    EXPECT_LT(all[0].load, kHigh);
}

TEST_F(AdviceTest, WhatBringsLessThanOnePercentIsNotTold) {
    line.serial.baud = 57600;
    add("press").think_time = 3s;
    ask(line.stations[0], 0, 1, 1s);
    EXPECT_THAT(find("serial").what, IsEmpty());
}

TEST_F(AdviceTest, PointsOfOneReadAreToldFromTheFirstToTheLast) {
    Station& press = add("press");
    for (const std::uint32_t first : {8u, 0u, 4u}) ask(press, first, 2, 40ms);
    ask(press, 2, 1, 10s);
    const Advice rarer = find("read press R0 to R8 every ");
    EXPECT_THAT(rarer.what, HasSubstr(" instead of 40ms"));
    EXPECT_LE(rarer.load, kHigh);
}

TEST_F(AdviceTest, PointsOfOneReadWithSeveralIntervalsAreToldWithAllOfThem) {
    Station& press = add("press");
    for (const std::uint32_t first : {8u, 0u}) ask(press, first, 2, 40ms);
    ask(press, 4, 2, 45ms);
    EXPECT_THAT(find("read press R0 to R8 every ").what, HasSubstr(" instead of 40ms to 45ms"));
}

TEST_F(AdviceTest, ABlockThatIsCutIsOne) {
    ask(add("press"), 0, 300, 500ms);
    EXPECT_THAT(find("read press R0 (300) every ").what, HasSubstr("instead of 500ms"));
}

TEST_F(AdviceTest, IntervalsEndAtADay) {
    ask(add("press"), 0, 100, 150ms);
    ask(line.stations[0], 5000, 1, 24h);
    EXPECT_THAT(find("all intervals ").what, HasSubstr("(24h at most)"));
}

TEST_F(AdviceTest, NothingIsToldThatBringsNothing) {
    line.serial.baud = 115200;
    ask(add("press"), 0, 100, 12ms);
    for (const Advice& one : advice()) EXPECT_LT(one.load, make_plan(line).load) << one.what;
    EXPECT_THAT(advice(), Not(IsEmpty()));
    EXPECT_THAT(find("serial").what, IsEmpty()) << "there is no higher one";
}

}  // namespace
}  // namespace panelgate::plan::advice_test
