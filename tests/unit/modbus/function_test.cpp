#include "panelgate/modbus/function.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <vector>

#include "support/hex.hpp"

namespace panelgate::modbus::function_test {
namespace {

TEST(Function, IsKnownPureReadOrBroadcastAsTheStandardSays) {
    const std::set<unsigned> standard = {1,  2,  3,  4,  5,  6,  7,  8,  11, 12,
                                         15, 16, 17, 20, 21, 22, 23, 24, 43};
    const std::set<unsigned> reads = {1, 2, 3, 4, 7, 11, 12, 17, 20, 24};
    const std::set<unsigned> plain_writes = {5, 6, 15, 16};
    for (unsigned code = 0; code < 256; ++code) {
        const auto function = static_cast<std::uint8_t>(code);
        EXPECT_EQ(is_known(function), standard.contains(code)) << code;
        EXPECT_EQ(function_name(function).empty(), !standard.contains(code)) << code;
        EXPECT_EQ(is_read(function), reads.contains(code)) << code;
        EXPECT_EQ(is_broadcastable(function), plain_writes.contains(code)) << code;
    }
}

TEST(Table, HasItsOwnReadAndItsWordOfThePaths) {
    const int reads[] = {1, 2, 4, 3};
    const char* const words[] = {"coils", "discrete-inputs", "input-registers",
                                 "holding-registers"};
    for (std::size_t i = 0; i < kTables.size(); ++i) {
        EXPECT_EQ(read_function(kTables[i]), reads[i]);
        EXPECT_EQ(label(kTables[i]), words[i]);
        EXPECT_EQ(is_bit_table(kTables[i]), i < 2);
    }
}

TEST(Exception, ReportsTheResultOfItsRequestToTheClient) {
    const std::map<Fault, unsigned> codes = {
        {Fault::denied, 0x01},    {Fault::malformed, 0x03}, {Fault::busy, 0x06},
        {Fault::expired, 0x06},   {Fault::line_down, 0x0A}, {Fault::not_routed, 0x0A},
        {Fault::cancelled, 0x0A}, {Fault::line_lost, 0x0B}, {Fault::timeout, 0x0B},
        {Fault::damaged, 0x0B},   {Fault::offline, 0x0B},   {Fault::wrong, 0x0B}};
    for (const Fault fault : kAllFaults) {
        EXPECT_EQ(static_cast<unsigned>(to_exception(fault)), codes.at(fault)) << label(fault);
    }
}

TEST(Exception, IsTwoBytesWithTheHighBitSet) {
    EXPECT_EQ(encode_exception(0x03, ExceptionCode::illegal_data_value), "83 03"_hex);
    EXPECT_EQ(encode_exception(0x00, ExceptionCode::illegal_function), "80 01"_hex);
    EXPECT_EQ(encode_exception(0x83, ExceptionCode::illegal_function), "83 01"_hex);
    EXPECT_EQ(exception_of("83 02"_hex), 2);
    EXPECT_EQ(exception_of("83 41"_hex), 0x41) << "vendors' codes pass";
    for (const Bytes& none : {"03 02"_hex, "83"_hex, "83 02 00"_hex, ""_hex})
        EXPECT_FALSE(exception_of(none)) << to_hex(none);
}

TEST(Exception, HasAWordForEveryCodeOfTheStandardAndANumberForOthers) {
    const char* const words[] = {"exception 0",
                                 "illegal function",
                                 "illegal data address",
                                 "illegal data value",
                                 "server device failure",
                                 "acknowledge",
                                 "server device busy",
                                 "exception 7",
                                 "memory parity error",
                                 "exception 9",
                                 "gateway path unavailable",
                                 "gateway target device failed to respond",
                                 "exception 12"};
    std::uint8_t code = 0;
    for (const char* word : words) EXPECT_EQ(describe_exception(code++), word);
    EXPECT_EQ(describe_exception(255), "exception 255");
}

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
}  // namespace panelgate::modbus::function_test
