#include "panelgate/points/read_plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace panelgate::points::read_plan_test {
namespace {

using modbus::Table;
using testing::SizeIs;

constexpr Table kRegisters = Table::holding_registers;

using Ranges = std::vector<profile::AddressRange>;

PlanLimits limits_of(std::uint32_t max_items, const Ranges& readable = {}) {
    PlanLimits limits;
    for (TableLimits& table : limits.tables) table = {max_items, readable};
    return limits;
}

Want want(std::uint32_t address, std::uint32_t count = 1, Duration every = 1s) {
    return {{kRegisters, address, count}, every};
}

modbus::Span span(std::uint32_t address, std::uint32_t count) {
    return {kRegisters, address, count};
}

/// "10+2(0 1)": 2 items from 10 for these wants; "/500": every 500 ms and not 1 s.
std::string text_of(const PlannedRead& read) {
    std::string wants;
    for (const std::size_t one : read.wants)
        wants += (wants.empty() ? "" : " ") + std::to_string(one);
    return std::to_string(read.span.first) + '+' + std::to_string(read.span.count) + '(' + wants +
           ')' + (read.every == 1s ? "" : '/' + std::to_string(read.every / 1ms));
}

std::string text_of(const std::vector<PlannedRead>& plan) {
    std::string text;
    for (const PlannedRead& read : plan) text += (text.empty() ? "" : " ") + text_of(read);
    return text;
}

TEST(ReadPlan, CountsWhatNobodyElseCanUseAsTheCostOfAReadAndOfAWrite) {
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
    const auto expect_write = [&](Table table, std::uint32_t count, bool single, unsigned bytes) {
        EXPECT_NEAR(to_seconds(write_cost(limits, table, count, single)),
                    to_seconds(wire_time(limits.serial, bytes) + silence), 1e-8);
    };
    expect_write(kRegisters, 10, false, 9 + 20 + 8);
    expect_write(Table::coils, 9, false, 9 + 2 + 8);
    expect_write(kRegisters, 1, true, 8 + 8);
}

// That every want is served, no want torn, no hole crossed, and that no cheaper plan of one
// interval exists: read_plan_random_test.
TEST(ReadPlan, ServesEveryWantWithFewReads) {
    struct Case {
        const char* why;
        PlanLimits limits;
        std::vector<Want> wants;
        const char* reads;
    };
    const PlanLimits limits = limits_of(125);
    const Case cases[] = {
        {"neighbours", limits, {want(12, 2), want(10), want(11)}, "10+4(0 1 2)"},
        {"two areas", limits_of(125, {{0, 11}, {12, 100}}), {want(10), want(13)}, "10+4(0 1)"},
        {"a hole", limits_of(125, {{0, 11}, {13, 100}}), {want(10), want(13)}, "10+1(0) 13+1(1)"},
        {"too large", limits, {want(0, 300), want(300, 10)}, "0+125(0) 125+125(0) 250+60(0 1)"},
        {"a slow want in a fast read", limits, {want(12, 1, 10s), want(10, 5)}, "10+5(0 1)"},
        {"dearer per second", limits, {want(0, 2), want(2, 100, 60s)}, "0+2(0) 2+100(1)/60000"},
        {"invalid",
         limits,
         {want(0, 0), want(65535, 2), want(70000), want(1, 0xFFFF'FFFF), want(1, 1, 0s)},
         ""},
        {"an unreadable table", limits_of(0), {want(1)}, ""},
        {"the last item", limits_of(125, {{0, 65535}}), {want(65535)}, "65535+1(0)"},
    };
    for (const Case& c : cases) EXPECT_EQ(text_of(plan_reads(c.wants, c.limits)), c.reads) << c.why;
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
    EXPECT_THAT(plan_reads(wants, limits_of(2000, {{0, 65535}})), SizeIs(33));  // 125 in 2000 items
}

TEST(Bisect, HasNothingToCutInOneWantOrTheSameItems) {
    const std::vector<Want> wants = {want(4, 2), want(4, 2), want(0, 300), want(0, 4), want(2, 4)};
    EXPECT_FALSE(bisect({span(4, 2), 1s, {0}}, wants).has_value());
    EXPECT_FALSE(bisect({span(4, 2), 1s, {0, 1}}, wants).has_value());
    EXPECT_FALSE(bisect({span(125, 125), 1s, {2}}, wants).has_value());
    const auto halves = bisect({span(0, 6), 500ms, {3, 4}}, wants);
    ASSERT_TRUE(halves.has_value());
    EXPECT_EQ(text_of(std::vector{halves->first, halves->second}), "0+4(3) 2+4(4)")
        << "each at its interval";
}

/// Halves refused reads of a panel that lacks one item, until its read is alone. Returns the number
/// of exceptions.
int exceptions_of(const std::vector<Want>& wants, std::uint32_t missing) {
    int exceptions = 0;
    std::vector<PlannedRead> todo = plan_reads(wants, limits_of(125, {{0, 100}}));
    while (!todo.empty()) {
        const PlannedRead read = todo.back();
        todo.pop_back();
        if (missing < read.span.first || missing >= read.span.end()) continue;
        ++exceptions;
        const auto halves = bisect(read, wants);
        if (halves) todo.insert(todo.end(), {halves->first, halves->second});
    }
    return exceptions;
}

TEST(Bisect, FindsWhatAPanelRefusesInALogarithmOfRequests) {
    std::vector<Want> wants;
    for (std::uint32_t i = 0; i < 64; ++i) wants.push_back(want(i));
    EXPECT_EQ(exceptions_of(wants, 37), 7);
    wants.erase(wants.begin() + 30, wants.begin() + 34);
    EXPECT_EQ(exceptions_of(wants, 32), 1) << "cut at the hole";
}

}  // namespace
}  // namespace panelgate::points::read_plan_test
