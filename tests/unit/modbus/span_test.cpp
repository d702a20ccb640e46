#include "panelgate/modbus/function.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <vector>

namespace panelgate::modbus::span_test {
namespace {

std::set<std::uint32_t> items(const Span& span) {
    std::set<std::uint32_t> all;
    for (std::uint32_t item = span.first; item < span.end(); ++item) all.insert(item);
    return all;
}

/// Every span of a small table.
std::vector<Span> all_spans(Table table) {
    std::vector<Span> spans;
    for (std::uint32_t first = 0; first < 6; ++first) {
        for (std::uint32_t count = 1; first + count <= 6; ++count)
            spans.push_back({table, first, count});
    }
    return spans;
}

TEST(Span, ContainsOverlapsTouchesAndJoinAreThoseOfTheItems) {
    for (const Span& a : all_spans(Table::holding_registers)) {
        for (const Span& b : all_spans(Table::holding_registers)) {
            std::set<std::uint32_t> both = items(a);
            both.merge(items(b));
            const bool no_hole = *both.rbegin() - *both.begin() + 1 == both.size();
            EXPECT_EQ(a.contains(b), both == items(a));
            EXPECT_EQ(a.overlaps(b), both.size() < a.count + b.count);
            EXPECT_EQ(a.touches(b), no_hole);
            if (no_hole) EXPECT_EQ(items(join(a, b)), both);
        }
    }
}

TEST(Span, OfAnotherTableHasNothingInCommon) {
    const Span span{Table::holding_registers, 0, 100};
    for (const Table table : kTables) {
        const Span other{table, 0, 100};
        EXPECT_EQ(span.contains(other), table == span.table);
        EXPECT_EQ(span.overlaps(other), table == span.table);
        EXPECT_EQ(span.touches(other), table == span.table);
    }
}

TEST(Span, MayReachTheEndOfTheTable) {
    const Span last{Table::coils, 65535, 1};
    EXPECT_EQ(last.end(), kTableItems);
    EXPECT_TRUE((Span{Table::coils, 0, kTableItems}.contains(last)));
}

}  // namespace
}  // namespace panelgate::modbus::span_test
