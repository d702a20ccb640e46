#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "panelgate/points/read_plan.hpp"

namespace panelgate::points::read_plan_random_test {
namespace {

using modbus::Table;

constexpr Table kRegisters = Table::holding_registers;

/// Generates stations: a few wants in a small memory, small limits.
struct Random {
    explicit Random(unsigned seed) : engine(seed) {}
    std::uint32_t below(std::uint32_t bound) {
        return static_cast<std::uint32_t>(engine()) % bound;
    }
    Table table() { return below(4) == 0 ? Table::coils : kRegisters; }
    PlanLimits limits() {
        PlanLimits made;
        made.serial.baud = below(2) == 0 ? 9600 : 115200;
        made.think_time = below(3) * 1ms;
        for (TableLimits& one : made.tables) {
            one.max_items = 1 + below(24);
            for (std::uint32_t i = below(3); i > 0; --i) {
                const std::uint32_t first = below(80);
                one.readable.push_back({first, first + below(40)});
            }
        }
        return made;
    }
    std::vector<Want> wants(std::uint32_t most, std::uint32_t max_count, std::uint32_t intervals) {
        std::vector<Want> made(1 + below(most));
        for (Want& one : made) {
            const Duration every = std::array<Duration, 3>{1s, 2s, 10s}[below(intervals)];
            one = {{table(), below(80), 1 + below(below(4) == 0 ? max_count : 3)}, every};
        }
        return made;
    }

    std::minstd_rand engine;
};

using Items = std::bitset<160>;  // of one table: random stations use no other

Items items_of(std::uint32_t first, std::uint32_t count) {
    return (~Items() >> (Items().size() - count)) << first;
}

/// True if an item of the read is neither in a want nor readable.
bool crosses_hole(const modbus::Span& read, const std::vector<Want>& wants,
                  const PlanLimits& limits) {
    Items open;
    for (const profile::AddressRange& range : limits.of(read.table).readable)
        open |= items_of(range.first, range.last + 1 - range.first);
    for (const Want& one : wants)
        if (one.span.table == read.table) open |= items_of(one.span.first, one.span.count);
    return (items_of(read.first, read.count) & ~open).any();
}

/// Returns the items of a want that a read contains.
modbus::Span part_of(const Want& one, const PlannedRead& read) {
    const std::uint32_t first = std::max(one.span.first, read.span.first);
    const std::uint32_t end = std::min(one.span.end(), read.span.end());
    return {one.span.table, first, end > first ? end - first : 0};
}

/// Returns what is wrong with a read, or "".
std::string judge(const PlannedRead& read, const std::vector<Want>& wants,
                  const PlanLimits& limits) {
    if (read.span.count == 0 || read.span.count > limits.of(read.span.table).max_items)
        return "beyond a limit";
    if (crosses_hole(read.span, wants, limits)) return "crosses a hole";
    if (read.wants.empty()) return "nobody wants it";
    for (const std::size_t index : read.wants) {
        const Want& one = wants[index];
        if (one.span.table != read.span.table || part_of(one, read).count == 0)
            return "serves a stranger";
        if (one.span.count <= limits.of(one.span.table).max_items && !read.span.contains(one.span))
            return "a want is torn";
        if (read.every > one.every) return "too rarely";
    }
    return "";
}

std::string judge(const std::vector<PlannedRead>& plan, const std::vector<Want>& wants,
                  const PlanLimits& limits) {
    std::vector<Items> missing;
    for (const Want& one : wants) missing.push_back(items_of(one.span.first, one.span.count));
    for (const PlannedRead& read : plan) {
        if (std::string fault = judge(read, wants, limits); !fault.empty()) return fault;
        for (const std::size_t index : read.wants)
            missing[index] &= ~items_of(read.span.first, read.span.count);
    }
    const bool whole = std::ranges::all_of(missing, [](const Items& left) { return left.none(); });
    return whole ? "" : "a want is not covered";
}

TEST(RandomReadPlan, KeepsItsPromisesForAHundredThousandStations) {
    Random random(20261121);
    for (int i = 0; i < 100'000; ++i) {
        const PlanLimits limits = random.limits();
        const std::vector<Want> wants = random.wants(10, 40, 3);
        ASSERT_EQ(judge(plan_reads(wants, limits), wants, limits), "") << "station " << i;
    }
}

using Parts = std::vector<std::vector<Want>>;

/// Returns the share of the wire of one read for these of the wants; -1 if they may not be read
/// together. A want inside a longer read is no reason to refuse.
double load_of(const std::vector<Want>& part, const std::vector<Want>& wants,
               const PlanLimits& limits) {
    modbus::Span box = part.front().span;
    Duration every = part.front().every;
    for (const Want& one : part) {
        if (one.span.table != box.table) return -1;
        box = join(box, one.span);
        every = std::min(every, one.every);
    }
    const bool same = std::ranges::all_of(part, [&](const Want& one) { return one.span == box; });
    if (!same && (box.count > limits.of(box.table).max_items || crosses_hole(box, wants, limits)))
        return -1;
    return to_seconds(read_cost(limits, box.table, box.count)) / to_seconds(every);
}

/// Returns the minimum load over all partitions into reads that begin with `parts`.
double least_load(const std::vector<Want>& wants, const PlanLimits& limits, Parts& parts,
                  std::size_t index = 0) {
    double best = 0;
    if (index == wants.size()) {
        for (const std::vector<Want>& part : parts) best += load_of(part, wants, limits);
        return best;
    }
    parts.push_back({wants[index]});
    best = least_load(wants, limits, parts, index + 1);
    parts.pop_back();
    for (std::size_t i = 0; i < parts.size(); ++i) {
        parts[i].push_back(wants[index]);
        if (load_of(parts[i], wants, limits) >= 0)
            best = std::min(best, least_load(wants, limits, parts, index + 1));
        parts[i].pop_back();
    }
    return best;
}

/// Returns the largest ratio of the plan's load to the minimum, over random stations.
double worst_ratio(int stations, std::uint32_t intervals, unsigned seed) {
    Random random(seed);
    double worst = 1;
    for (int i = 0; i < stations; ++i) {
        PlanLimits limits = random.limits();
        for (TableLimits& table : limits.tables) table.max_items = 8 + random.below(24);
        if (i % 2 == 0) limits.of(kRegisters).readable = {{0, 119}};
        const std::vector<Want> wants = random.wants(i % 10 == 0 ? 8 : 6, 8, intervals);
        double load = 0;
        for (const PlannedRead& read : plan_reads(wants, limits))
            load += to_seconds(read_cost(limits, read.span.table, read.span.count)) /
                    to_seconds(read.every);
        Parts parts;
        worst = std::max(worst, load / least_load(wants, limits, parts));
    }
    return worst;
}

TEST(RandomReadPlan, IsTheBestPlanOfOneIntervalAndNearItOfSeveral) {
    EXPECT_LE(worst_ratio(5000, 1, 1), 1 + 1e-9) << "all the same";
    EXPECT_LE(worst_ratio(10'000, 3, 2), 1.5);
}

}  // namespace
}  // namespace panelgate::points::read_plan_random_test
