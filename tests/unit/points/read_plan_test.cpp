#include "panelgate/points/read_plan.hpp"

#include <gmock/gmock.h>

#include <set>

namespace panelgate::points::read_plan_test {
namespace {

using modbus::Table;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

constexpr Table kRegisters = Table::holding_registers;

PlanLimits limits_of(std::uint32_t max_items, std::vector<profile::AddressRange> readable = {}) {
    PlanLimits limits;
    for (TableLimits& table : limits.tables) table = {max_items, readable};
    return limits;
}

Want want(std::uint32_t address, std::uint32_t count = 1, Duration every = 1s) {
    return {{kRegisters, address, count}, every};
}

std::vector<modbus::Span> spans(const std::vector<PlannedRead>& plan) {
    std::vector<modbus::Span> result;
    for (const PlannedRead& read : plan) result.push_back(read.span);
    return result;
}

modbus::Span span(std::uint32_t address, std::uint32_t count) {
    return {kRegisters, address, count};
}

TEST(ReadPlan, CountsWhatNobodyElseCanUseAsTheCostOfARead) {
    PlanLimits limits = limits_of(125);
    limits.serial = {.baud = 9600, .data_bits = 8, .parity = Parity::none, .stop_bits = 1};
    limits.gap = 4ms;
    limits.think_time = 3ms;
    const Duration silence = 7ms + silent_interval(limits.serial);  // the panel's, and the gap
    // 8 characters, 5 + 20 characters of 10 bits at 9600 bit/s.
    EXPECT_EQ(read_cost(limits, kRegisters, 10),
              wire_time(limits.serial, 8) + wire_time(limits.serial, 25) + silence);
    EXPECT_EQ(read_cost(limits, Table::coils, 9),
              wire_time(limits.serial, 8) + wire_time(limits.serial, 7) + silence);
}

TEST(ReadPlan, AWriteCostsItsFramesAndTheSameSilences) {
    PlanLimits limits = limits_of(125);
    limits.gap = 4ms;
    limits.think_time = 3ms;
    const Duration silence = 7ms + silent_interval(limits.serial);
    const auto frames = [&](std::size_t bytes) {
        return wire_time(limits.serial, bytes) + silence;
    };
    EXPECT_NEAR(to_seconds(write_cost(limits, kRegisters, 10, false)),
                to_seconds(frames(9 + 20 + 8)), 1e-8);
    EXPECT_NEAR(to_seconds(write_cost(limits, Table::coils, 9, false)),
                to_seconds(frames(9 + 2 + 8)), 1e-8);
    EXPECT_NEAR(to_seconds(write_cost(limits, kRegisters, 1, true)), to_seconds(frames(8 + 8)),
                1e-8);
}

TEST(ReadPlan, ReadsNeighboursTogether) {
    const std::vector<Want> wants = {want(12, 2), want(10), want(11)};
    const auto plan = plan_reads(wants, limits_of(125));
    ASSERT_THAT(spans(plan), ElementsAre(span(10, 4)));
    EXPECT_THAT(plan[0].wants, ElementsAre(0, 1, 2));
    EXPECT_EQ(plan[0].every, 1s);
    EXPECT_FALSE(plan[0].refused);
}

TEST(ReadPlan, CrossesAHoleOnlyWhereTheProfileSaysThatItIsReadable) {
    const std::vector<Want> wants = {want(10), want(13)};
    EXPECT_THAT(spans(plan_reads(wants, limits_of(125, {{0, 100}}))), ElementsAre(span(10, 4)));
    EXPECT_THAT(spans(plan_reads(wants, limits_of(125, {{0, 11}, {12, 100}}))),
                ElementsAre(span(10, 4)));
    EXPECT_THAT(spans(plan_reads(wants, limits_of(125, {{0, 11}, {13, 100}}))),
                ElementsAre(span(10, 1), span(13, 1)));
}

TEST(ReadPlan, ReadsAcrossAHoleOnlyWhileThatIsCheaperThanAnotherRequest) {
    PlanLimits limits = limits_of(125, {{0, 65535}});
    std::uint32_t hole = 0;
    while (plan_reads(std::vector{want(0), want(hole + 1)}, limits).size() == 1) ++hole;
    EXPECT_GT(read_cost(limits, kRegisters, hole + 2), 2 * read_cost(limits, kRegisters, 1));
    EXPECT_LE(read_cost(limits, kRegisters, hole + 1), 2 * read_cost(limits, kRegisters, 1));
}

TEST(ReadPlan, ServesOverlappingAndContainedWantsWithOneRead) {
    const std::vector<Want> wants = {want(10, 20), want(12, 2), want(28, 10), want(10, 20)};
    const auto plan = plan_reads(wants, limits_of(125));
    ASSERT_THAT(spans(plan), ElementsAre(span(10, 28)));
    EXPECT_THAT(plan[0].wants, ElementsAre(0, 1, 2, 3));
}

TEST(ReadPlan, NeverTearsAWantThatFitsIntoOneRead) {
    const auto plan = plan_reads(std::vector{want(0, 3), want(3, 3)}, limits_of(4));
    EXPECT_THAT(spans(plan), ElementsAre(span(0, 3), span(3, 3)));
}

TEST(ReadPlan, CutsAWantThatIsLargerThanARead) {
    const std::vector<Want> wants = {want(0, 300), want(300, 10)};
    const auto plan = plan_reads(wants, limits_of(125));
    ASSERT_THAT(spans(plan), ElementsAre(span(0, 125), span(125, 125), span(250, 60)));
    EXPECT_THAT(plan[0].wants, ElementsAre(0));
    EXPECT_THAT(plan[2].wants, ElementsAre(0, 1));
}

TEST(ReadPlan, KeepsTablesApart) {
    const std::vector<Want> wants = {{{Table::holding_registers, 1, 1}, 1s},
                                     {{Table::input_registers, 2, 1}, 1s},
                                     {{Table::coils, 1, 1}, 1s}};
    const auto plan = plan_reads(wants, limits_of(125, {{0, 100}}));
    ASSERT_THAT(plan, SizeIs(3));
    EXPECT_EQ(plan[0].span.table, Table::coils);
    EXPECT_EQ(plan[1].span.table, Table::input_registers);
}

TEST(ReadPlan, ServesASlowWantByAFastReadThatContainsIt) {
    const std::vector<Want> wants = {want(12, 1, 10s), want(10, 5, 1s)};
    const auto plan = plan_reads(wants, limits_of(125));
    ASSERT_THAT(spans(plan), ElementsAre(span(10, 5)));
    EXPECT_EQ(plan[0].every, 1s);
    EXPECT_THAT(plan[0].wants, ElementsAre(0, 1));
}

TEST(ReadPlan, JoinsIntervalsOnlyWhenThatIsNotDearerPerSecond) {
    const PlanLimits limits = limits_of(125);
    const auto cheap = plan_reads(std::vector{want(0, 2, 1s), want(2, 2, 2s)}, limits);
    ASSERT_THAT(spans(cheap), ElementsAre(span(0, 4)));
    EXPECT_EQ(cheap[0].every, 1s);
    const auto dear = plan_reads(std::vector{want(0, 2, 1s), want(2, 100, 60s)}, limits);
    EXPECT_THAT(spans(dear), ElementsAre(span(0, 2), span(2, 100)));
}

TEST(ReadPlan, ReadsNothingWithARefusedSpanInIt) {
    PlanLimits limits = limits_of(125, {{0, 100}});
    limits.refused = {span(12, 1)};
    const std::vector<Want> wants = {want(10), want(11), want(13), want(14)};
    EXPECT_THAT(spans(plan_reads(wants, limits)), ElementsAre(span(10, 2), span(13, 2)));
}

TEST(ReadPlan, AsksForARefusedWantAlone) {
    PlanLimits limits = limits_of(125, {{0, 100}});
    limits.refused = {span(12, 1)};
    const std::vector<Want> wants = {want(11), want(12), want(13), want(12, 1, 5s)};
    const auto plan = plan_reads(wants, limits);
    ASSERT_THAT(spans(plan), ElementsAre(span(11, 1), span(12, 1), span(13, 1)));
    EXPECT_TRUE(plan[1].refused);
    EXPECT_FALSE(plan[0].refused);
    EXPECT_THAT(plan[1].wants, ElementsAre(1, 3));
}

TEST(ReadPlan, AWantInsideARefusedOneIsReadWithoutIt) {
    PlanLimits limits = limits_of(125);
    limits.refused = {span(10, 20)};
    const std::vector<Want> wants = {want(10, 20), want(12, 2)};
    const auto plan = plan_reads(wants, limits);
    ASSERT_THAT(spans(plan), ElementsAre(span(10, 20), span(12, 2)));
    EXPECT_THAT(plan[0].wants, ElementsAre(0));
    EXPECT_THAT(plan[1].wants, ElementsAre(1));
}

TEST(ReadPlan, DoesNotPlanWhatCannotBeAskedFor) {
    const std::vector<Want> wants = {want(0, 0), want(65535, 2), want(70000), want(5, 0xFFFFFFFF),
                                     want(1, 1, 0s)};
    EXPECT_THAT(plan_reads(wants, limits_of(125)), IsEmpty());
    EXPECT_THAT(plan_reads(std::vector{want(1)}, limits_of(0)), IsEmpty());
    EXPECT_THAT(spans(plan_reads(std::vector{want(65535)}, limits_of(125, {{0, 65535}}))),
                ElementsAre(span(65535, 1)));
}

TEST(ReadPlan, TakesTheProfilesLimitsWithinTheStandards) {
    profile::PanelProfile panel;
    panel.functions = {{.code = modbus::kReadCoils, .max_count = 2040, .source = {}},
                       {.code = modbus::kReadHoldingRegisters, .max_count = 64, .source = {}}};
    profile::Area area;
    area.table = kRegisters;
    area.also = {Table::input_registers};
    area.readable = {10, 20};
    panel.areas = {area};
    const PlanLimits limits = make_plan_limits(panel, SerialFormat{}, 4ms);
    EXPECT_EQ(limits.of(Table::coils).max_items, 2000u);
    EXPECT_EQ(limits.of(kRegisters).max_items, 64u);
    EXPECT_EQ(limits.of(Table::input_registers).max_items, 0u);
    EXPECT_EQ(limits.gap, 4ms);
    EXPECT_THAT(limits.of(kRegisters).readable, SizeIs(1));
    EXPECT_THAT(limits.of(Table::input_registers).readable, SizeIs(1));
    const PlanLimits standard = make_plan_limits({}, SerialFormat{}, 4ms);
    EXPECT_EQ(standard.of(Table::discrete_inputs).max_items, 2000u);
    EXPECT_EQ(standard.of(Table::input_registers).max_items, 125u);
}

TEST(ReadPlan, PlansFourThousandScatteredBitsAtOnce) {
    std::vector<Want> wants;
    for (std::uint32_t i = 0; i < 4096; ++i) wants.push_back({{Table::coils, i * 16, 1}, 1s});
    const PlanLimits limits = limits_of(2000, {{0, 65535}});
    const auto plan = plan_reads(wants, limits);
    EXPECT_THAT(plan, SizeIs(33));  // 125 of them within 2000 items
}

TEST(Bisect, CutsAtTheWidestHole) {
    const std::vector<Want> wants = {want(0), want(1), want(5), want(6), want(8)};
    const auto plan = plan_reads(wants, limits_of(125, {{0, 100}}));
    ASSERT_THAT(plan, SizeIs(1));
    const auto halves = bisect(plan[0], wants);
    ASSERT_TRUE(halves.has_value());
    EXPECT_EQ(halves->first.span, span(0, 2));
    EXPECT_EQ(halves->second.span, span(5, 4));
    EXPECT_THAT(halves->second.wants, ElementsAre(2, 3, 4));
    EXPECT_EQ(refused_between(halves->first, halves->second), span(1, 5));
}

TEST(Bisect, CutsInTheMiddleWhenThereIsNoHole) {
    const std::vector<Want> wants = {want(0), want(1), want(2), want(3, 1, 500ms)};
    const PlannedRead read{{kRegisters, 0, 4}, 500ms, {0, 1, 2, 3}, false};
    const auto halves = bisect(read, wants);
    ASSERT_TRUE(halves.has_value());
    EXPECT_EQ(halves->first.span, span(0, 2));
    EXPECT_EQ(halves->first.every, 1s);
    EXPECT_EQ(halves->second.every, 500ms);
}

TEST(Bisect, LeavesAReadOfOneWantOrOfTheSameItemsAlone) {
    const std::vector<Want> wants = {want(4, 2), want(4, 2), want(0, 300)};
    EXPECT_FALSE(bisect({{kRegisters, 4, 2}, 1s, {0}, false}, wants).has_value());
    EXPECT_FALSE(bisect({{kRegisters, 4, 2}, 1s, {0, 1}, false}, wants).has_value());
    EXPECT_FALSE(bisect({{kRegisters, 125, 125}, 1s, {2}, false}, wants).has_value());
}

TEST(Bisect, KnowsNoSeamBetweenHalvesThatOverlap) {
    const std::vector<Want> wants = {want(0, 4), want(2, 4)};
    const auto halves = bisect({{kRegisters, 0, 6}, 1s, {0, 1}, false}, wants);
    ASSERT_TRUE(halves.has_value());
    EXPECT_FALSE(refused_between(halves->first, halves->second).has_value());
}

/// Simulates a panel that refuses every read containing one of `bad`, until only reads marked
/// `refused` are refused. Returns the number of exceptions.
int learn(const std::vector<Want>& wants, PlanLimits& limits, const std::set<std::uint32_t>& bad) {
    const auto refuses = [&](const PlannedRead& read) {
        const auto first = bad.lower_bound(read.span.first);
        return first != bad.end() && *first < read.span.end();
    };
    int exceptions = 0;
    std::vector<PlannedRead> todo = plan_reads(wants, limits);
    while (!todo.empty()) {
        const PlannedRead read = todo.back();
        todo.pop_back();
        if (!refuses(read)) continue;
        ++exceptions;
        if (const auto halves = bisect(read, wants)) {
            todo.push_back(halves->first);
            todo.push_back(halves->second);
            const auto between = refused_between(halves->first, halves->second);
            if (between && !refuses(halves->first) && !refuses(halves->second))
                limits.refused.push_back(*between);
        } else {
            limits.refused.push_back(read.span);
        }
    }
    return exceptions;
}

TEST(Bisect, FindsWhatAPanelRefusesInALogarithmOfRequests) {
    std::vector<Want> wants;
    for (std::uint32_t i = 0; i < 64; ++i) wants.push_back(want(i));
    PlanLimits limits = limits_of(125, {{0, 100}});
    EXPECT_EQ(learn(wants, limits, {37}), 7);
    const auto plan = plan_reads(wants, limits);
    EXPECT_THAT(spans(plan), ElementsAre(span(0, 37), span(37, 1), span(38, 26)));
    EXPECT_TRUE(plan[1].refused);

    PlanLimits holes = limits_of(125, {{0, 100}});
    wants.erase(wants.begin() + 30, wants.begin() + 34);
    EXPECT_EQ(learn(wants, holes, {32}), 1);
    EXPECT_THAT(spans(plan_reads(wants, holes)), ElementsAre(span(0, 30), span(34, 30)));
}

}  // namespace
}  // namespace panelgate::points::read_plan_test
