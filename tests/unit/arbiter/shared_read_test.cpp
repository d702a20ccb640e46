#include "panelgate/arbiter/shared_read.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <vector>

#include "support/hex.hpp"

namespace panelgate::arbiter {
namespace {

std::set<std::uint32_t> items(const ReadSpan& span) {
    std::set<std::uint32_t> all;
    for (std::uint32_t item = span.address; item < span.end(); ++item) all.insert(item);
    return all;
}

/// Every span of a small table.
std::vector<ReadSpan> all_spans(std::uint8_t function) {
    std::vector<ReadSpan> spans;
    for (std::uint32_t address = 0; address < 6; ++address) {
        for (std::uint32_t count = 1; address + count <= 6; ++count)
            spans.push_back({17, function, address, count});
    }
    return spans;
}

bool bit_of(std::uint32_t item) { return (item * item * 7 + item / 3) % 5 < 2; }
unsigned register_of(std::uint32_t item) { return (item * 40503 + 257) % 65536; }

/// What a panel answers whose items are known by their address.
Bytes panel_reply(const ReadSpan& span) {
    Writer out;
    out.u8(span.function);
    if (!span.reads_bits()) {
        out.u8(2 * span.count);
        for (const std::uint32_t item : items(span)) out.u16(register_of(item));
        return out.take();
    }
    out.u8((span.count + 7) / 8);
    for (std::uint32_t first = 0; first < span.count; first += 8) {
        unsigned packed = 0;
        for (std::uint32_t i = first; i < first + 8 && i < span.count; ++i)
            packed |= bit_of(span.address + i) ? 1U << (i - first) : 0U;
        out.u8(packed);
    }
    return out.take();
}

/// Every part of every offset and length is what the panel itself would have answered.
void expect_slices(const ReadSpan& whole) {
    const Bytes reply = panel_reply(whole);
    for (std::uint32_t offset = 0; offset < whole.count; ++offset) {
        for (std::uint32_t count = 1; offset + count <= whole.count; ++count) {
            const ReadSpan part{17, whole.function, whole.address + offset, count};
            ASSERT_EQ(slice_reply(whole, reply, part), panel_reply(part))
                << "function " << int{whole.function} << ", " << count << " from " << offset;
        }
    }
}

TEST(SharedRead, P6RegistersAreSlicedAtEveryOffset) {
    for (const std::uint8_t function : "03 04"_hex) {
        expect_slices({17, function, 0, 1});
        expect_slices({17, function, 65411, 125});
    }
}

TEST(SharedRead, P6BitsAreSlicedAtEveryOffsetAndThoseBehindTheEndAreZero) {
    for (const std::uint8_t function : "01 02"_hex) {
        for (const std::uint32_t count : {1U, 7U, 8U, 9U, 64U, 77U})
            expect_slices({17, function, 1003, count});
    }
}

TEST(SharedRead, TheWholeSlicedOutOfItselfIsTheSameReply) {
    for (const ReadSpan& whole :
         {ReadSpan{17, 1, 5, 2000}, ReadSpan{17, 2, 0, 1999}, ReadSpan{17, 3, 9, 125}}) {
        EXPECT_EQ(slice_reply(whole, panel_reply(whole), whole), panel_reply(whole));
    }
}

TEST(SharedRead, ASpanIsWhatOneOfTheFourReadsAsksFor) {
    const auto span = read_span(17, "04 01 02 00 7D"_hex);
    ASSERT_TRUE(span);
    EXPECT_EQ(*span, (ReadSpan{17, 4, 0x102, 125}));
    EXPECT_EQ(span->end(), 0x102u + 125u);
    for (const std::uint8_t function : "01 02 03 04"_hex) {
        const Bytes pdu = Writer().u8(function).u16(65535).u16(1).take();
        const auto last = read_span(18, pdu);
        ASSERT_TRUE(last);
        EXPECT_EQ(encode_span(*last), pdu);
    }
}

TEST(SharedRead, WhatIsNoReadOrReadsNothingOrBeyondTheEndIsNone) {
    for (const Bytes& pdu :
         {""_hex, "03"_hex, "03 00 00 00"_hex, "03 00 00 00 01 00"_hex, "03 00 00 00 00"_hex,
          "03 FF FF 00 02"_hex, "05 00 00 FF 00"_hex, "06 00 00 00 01"_hex, "83 00 00 00 01"_hex,
          "17 00 00 00 01 00 00 00 01 02 00 00"_hex, "00 00 00 00 01"_hex}) {
        EXPECT_FALSE(read_span(17, pdu)) << to_hex(pdu);
    }
}

TEST(SharedRead, ContainsTouchesAndJoinAreThoseOfTheItems) {
    for (const ReadSpan& a : all_spans(3)) {
        for (const ReadSpan& b : all_spans(3)) {
            std::set<std::uint32_t> both = items(a);
            both.merge(items(b));
            const bool no_hole = *both.rbegin() - *both.begin() + 1 == both.size();
            EXPECT_EQ(a.contains(b), both == items(a));
            EXPECT_EQ(a.touches(b), no_hole);
            if (no_hole) EXPECT_EQ(items(join(a, b)), both);
        }
    }
}

TEST(SharedRead, ReadsOfAnotherStationOrFunctionHaveNothingInCommon) {
    const ReadSpan whole{17, 3, 0, 100};
    for (const ReadSpan& other : {ReadSpan{18, 3, 0, 100}, ReadSpan{17, 4, 0, 100}}) {
        EXPECT_FALSE(whole.contains(other));
        EXPECT_FALSE(whole.touches(other));
        EXPECT_FALSE(whole.same_table(other));
    }
}

}  // namespace
}  // namespace panelgate::arbiter
