#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bitset>
#include <random>
#include <string>

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

    PlanLimits limits() {
        PlanLimits made;
        made.serial.baud = below(2) == 0 ? 9600 : 115200;
        made.think_time = below(3) * 1ms;
        for (TableLimits& table : made.tables) {
            table.max_items = 1 + below(24);
            for (std::uint32_t i = below(3); i > 0; --i) {
                const std::uint32_t first = below(80);
                table.readable.push_back({first, first + below(40)});
            }
        }
        for (std::uint32_t i = below(3); i > 0; --i)
            made.refused.push_back({table(), below(80), 1 + below(6)});
        return made;
    }
    Table table() { return below(4) == 0 ? Table::coils : kRegisters; }
    Want any_want(std::uint32_t max_count, std::uint32_t intervals) {
        const Duration every = std::array<Duration, 3>{1s, 2s, 10s}[below(intervals)];
        return {{table(), below(80), 1 + below(below(4) == 0 ? max_count : 3)}, every};
    }
    std::vector<Want> wants(std::uint32_t most, std::uint32_t max_count, std::uint32_t intervals) {
        std::vector<Want> made(1 + below(most));
        for (Want& one : made) one = any_want(max_count, intervals);
        return made;
    }

    std::minstd_rand engine;
};

using Items = std::bitset<160>;  // of one table: random stations use no other

Items items_of(std::uint32_t first, std::uint32_t count) {
    return (~Items() >> (Items().size() - count)) << first;
}

/// Returns the items that are in a want or readable.
Items open_items(Table table, const std::vector<Want>& wants, const PlanLimits& limits) {
    Items open;
    for (const profile::AddressRange& range : limits.of(table).readable)
        open |= items_of(range.first, range.last + 1 - range.first);
    for (const Want& one : wants)
        if (one.span.table == table) open |= items_of(one.span.first, one.span.count);
    return open;
}

bool crosses_hole(const modbus::Span& read, const std::vector<Want>& wants,
                  const PlanLimits& limits) {
    return (items_of(read.first, read.count) & ~open_items(read.table, wants, limits)).any();
}

bool contains_refused(const modbus::Span& read, const PlanLimits& limits) {
    return std::any_of(limits.refused.begin(), limits.refused.end(),
                       [&](const modbus::Span& span) { return read.contains(span); });
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
    if (contains_refused(read.span, limits) != read.refused) return "refused is wrong";
    for (const std::size_t index : read.wants) {
        const Want& one = wants[index];
        if (one.span.table != read.span.table || part_of(one, read).count == 0)
            return "serves a stranger";
        if (read.refused && part_of(one, read) != read.span) return "refused with others";
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
    const bool whole =
        std::all_of(missing.begin(), missing.end(), [](const Items& left) { return left.none(); });
    return whole ? "" : "a want is not covered";
}

TEST(RandomReadPlan, KeepsItsPromisesForAHundredThousandStations) {
    Random random(20261121);
    for (int i = 0; i < 100'000; ++i) {
        const PlanLimits limits = random.limits();
        const std::vector<Want> wants = random.wants(10, 40, 3);
        const std::string fault = judge(plan_reads(wants, limits), wants, limits);
        ASSERT_EQ(fault, "") << "station " << i;
    }
}

/// Finds the minimum load (share of the wire) over all partitions of the wants into reads.
class ExhaustiveSearch {
  public:
    ExhaustiveSearch(const std::vector<Want>& wants, const PlanLimits& limits)
        : wants_(wants), limits_(limits) {
        place(0);
    }
    double best() const { return best_; }

  private:
    void place(std::size_t index) {
        if (index == wants_.size()) {
            best_ = std::min(best_, total());
            return;
        }
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            parts_[i].push_back(wants_[index]);
            if (load(parts_[i]) >= 0) place(index + 1);
            parts_[i].pop_back();
        }
        parts_.push_back({wants_[index]});
        place(index + 1);
        parts_.pop_back();
    }
    /// Returns -1 if these may not be read together. A want inside a longer read is no reason to
    /// refuse.
    double load(const std::vector<Want>& part) const {
        modbus::Span box = part.front().span;
        Duration every = part.front().every;
        for (const Want& one : part) {
            if (one.span.table != box.table) return -1;
            const std::uint32_t end = std::max(box.end(), one.span.end());
            box.first = std::min(box.first, one.span.first);
            box.count = end - box.first;
            every = std::min(every, one.every);
        }
        const bool same =
            std::all_of(part.begin(), part.end(), [&](const Want& one) { return one.span == box; });
        if (!same && (box.count > limits_.of(box.table).max_items ||
                      crosses_hole(box, wants_, limits_) || contains_refused(box, limits_)))
            return -1;
        return to_seconds(read_cost(limits_, box.table, box.count)) / to_seconds(every);
    }
    double total() const {
        double sum = 0;
        for (const std::vector<Want>& part : parts_) sum += load(part);
        return sum;
    }

    const std::vector<Want>& wants_;
    const PlanLimits& limits_;
    std::vector<std::vector<Want>> parts_;
    double best_ = 1e9;
};

double load_of(const std::vector<PlannedRead>& plan, const PlanLimits& limits) {
    double sum = 0;
    for (const PlannedRead& read : plan)
        sum += to_seconds(read_cost(limits, read.span.table, read.span.count)) /
               to_seconds(read.every);
    return sum;
}

/// Ratio of the plan's load to the minimum, over random stations.
struct Ratios {
    double worst = 1;
};

Ratios compare(int stations, std::uint32_t intervals, unsigned seed) {
    Random random(seed);
    Ratios result;
    for (int i = 0; i < stations; ++i) {
        PlanLimits limits = random.limits();
        for (TableLimits& table : limits.tables) table.max_items = 8 + random.below(24);
        if (i % 2 == 0) limits.of(kRegisters).readable = {{0, 119}};
        const std::vector<Want> wants = random.wants(i % 10 == 0 ? 8 : 6, 8, intervals);
        const double best = ExhaustiveSearch(wants, limits).best();
        const double ratio = load_of(plan_reads(wants, limits), limits) / best;
        result.worst = std::max(result.worst, ratio);
    }
    return result;
}

TEST(RandomReadPlan, IsTheBestPlanWhereAllIntervalsAreTheSame) {
    EXPECT_LE(compare(5000, 1, 1).worst, 1 + 1e-9);
}

TEST(RandomReadPlan, IsTheBestPlanOfFewWantsWhereIntervalsDiffer) {
    EXPECT_LE(compare(10'000, 3, 2).worst, 1 + 1e-9);
}

}  // namespace
}  // namespace panelgate::points::read_plan_random_test
