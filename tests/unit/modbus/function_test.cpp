#include "panelgate/modbus/function.hpp"

#include <gtest/gtest.h>

#include <set>

namespace panelgate::modbus::function_test {
namespace {

TEST(Function, KnowsTheNineteenOfTheStandard) {
    const std::set<unsigned> standard = {1,  2,  3,  4,  5,  6,  7,  8,  11, 12,
                                         15, 16, 17, 20, 21, 22, 23, 24, 43};
    for (unsigned code = 0; code < 256; ++code) {
        const auto function = static_cast<std::uint8_t>(code);
        EXPECT_EQ(is_known(function), standard.contains(code)) << code;
        EXPECT_EQ(function_name(function).empty(), !standard.contains(code)) << code;
    }
}

TEST(Function, CountsAsReadOnlyWhatCannotChangeAnything) {
    const std::set<unsigned> reads = {1, 2, 3, 4, 7, 11, 12, 17, 20, 24};
    for (unsigned code = 0; code < 256; ++code) {
        EXPECT_EQ(is_read(static_cast<std::uint8_t>(code)), reads.contains(code)) << code;
    }
}

TEST(Function, BroadcastsTheFourPlainWrites) {
    const std::set<unsigned> writes = {5, 6, 15, 16};
    for (unsigned code = 0; code < 256; ++code) {
        EXPECT_EQ(is_broadcastable(static_cast<std::uint8_t>(code)), writes.contains(code)) << code;
    }
}

TEST(Function, ReadsEachTableWithItsOwnCode) {
    EXPECT_EQ(read_function(Table::coils), 1);
    EXPECT_EQ(read_function(Table::discrete_inputs), 2);
    EXPECT_EQ(read_function(Table::holding_registers), 3);
    EXPECT_EQ(read_function(Table::input_registers), 4);
}

TEST(Function, NamesTablesAsThePathsDo) {
    EXPECT_EQ(label(Table::coils), "coils");
    EXPECT_EQ(label(Table::discrete_inputs), "discrete-inputs");
    EXPECT_EQ(label(Table::holding_registers), "holding-registers");
    EXPECT_EQ(label(Table::input_registers), "input-registers");
    EXPECT_TRUE(is_bit_table(Table::discrete_inputs));
    EXPECT_FALSE(is_bit_table(Table::input_registers));
}

}  // namespace
}  // namespace panelgate::modbus::function_test
