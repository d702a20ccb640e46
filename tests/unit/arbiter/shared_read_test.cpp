#include "panelgate/arbiter/read_cache.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace panelgate::arbiter::shared_read_test {
namespace {

constexpr modbus::Table kRegisters = modbus::Table::holding_registers;

bool bit_of(std::uint32_t item) { return (item * item * 7 + item / 3) % 5 < 2; }
unsigned register_of(std::uint32_t item) { return (item * 40503 + 257) % 65536; }

/// What a panel answers whose items are known by their address.
Bytes panel_reply(const modbus::Span& span) {
    Writer out;
    out.u8(modbus::read_function(span.table));
    if (!modbus::is_bit_table(span.table)) {
        out.u8(2 * span.count);
        for (std::uint32_t item = span.first; item < span.end(); ++item) out.u16(register_of(item));
        return out.take();
    }
    out.u8((span.count + 7) / 8);
    for (std::uint32_t first = 0; first < span.count; first += 8) {
        unsigned packed = 0;
        for (std::uint32_t i = first; i < first + 8 && i < span.count; ++i)
            packed |= bit_of(span.first + i) ? 1U << (i - first) : 0U;
        out.u8(packed);
    }
    return out.take();
}

/// Every part of every offset and length is what the panel itself would have answered.
void expect_slices(const modbus::Span& whole) {
    const Bytes reply = panel_reply(whole);
    for (std::uint32_t offset = 0; offset < whole.count; ++offset) {
        for (std::uint32_t count = 1; offset + count <= whole.count; ++count) {
            const modbus::Span part{whole.table, whole.first + offset, count};
            ASSERT_EQ(slice_reply(whole, reply, part), panel_reply(part))
                << label(whole.table) << ", " << count << " from " << offset;
        }
    }
}

TEST(SharedRead, P6RegistersAreSlicedAtEveryOffset) {
    for (const modbus::Table table : {kRegisters, modbus::Table::input_registers}) {
        expect_slices({table, 0, 1});
        expect_slices({table, 65411, 125});
    }
}

TEST(SharedRead, P6BitsAreSlicedAtEveryOffsetAndThoseBehindTheEndAreZero) {
    for (const modbus::Table table : {modbus::Table::coils, modbus::Table::discrete_inputs}) {
        for (const std::uint32_t count : {1U, 7U, 8U, 9U, 64U, 77U})
            expect_slices({table, 1003, count});
    }
}

TEST(SharedRead, TheWholeSlicedOutOfItselfIsTheSameReply) {
    using modbus::Span;
    using modbus::Table;
    for (const Span& whole : {Span{Table::coils, 5, 2000}, Span{Table::discrete_inputs, 0, 1999},
                              Span{kRegisters, 9, 125}}) {
        EXPECT_EQ(slice_reply(whole, panel_reply(whole), whole), panel_reply(whole));
    }
}

TEST(SharedRead, ReadsOfAnotherStationOrTableHaveNothingInCommon) {
    const ReadSpan whole{17, {kRegisters, 0, 100}};
    EXPECT_TRUE(whole.contains({17, {kRegisters, 0, 100}}));
    for (const ReadSpan& other :
         {ReadSpan{18, {kRegisters, 0, 100}}, ReadSpan{17, {modbus::Table::coils, 0, 100}}}) {
        EXPECT_FALSE(whole.contains(other));
        EXPECT_FALSE(whole.same_table(other));
    }
}

}  // namespace
}  // namespace panelgate::arbiter::shared_read_test
