#include "panelgate/arbiter/queue/read_cache.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "support/hex.hpp"
#include "support/read_span.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::read_cache_test {
namespace {

using modbus::Span;
using modbus::Table;

constexpr Table kRegisters = Table::holding_registers;
constexpr TimePoint kStart{1h};
const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
const Bytes kWrite = "06 00 6B 00 01"_hex;
const ReadSpan kSpan = *test::read_span(17, kRead);
const ReadSpan kSecond = *test::read_span(17, "03 00 6C 00 01"_hex);

TEST(ReadCache, AnswersWhatItHoldsWhileItIsYoungEnough) {
    ReadCache cache;
    cache.store(kSpan, kReply, kStart);
    const auto hit = cache.find(kSecond, kStart + 1s, 1s);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->pdu, "03 02 00 00"_hex);
    EXPECT_EQ(hit->age, Duration(1s));
    EXPECT_FALSE(cache.find(kSecond, kStart + 1001ms, 1s));
    EXPECT_FALSE(cache.find(*test::read_span(18, kRead), kStart, 1s));
    EXPECT_FALSE(cache.find(*test::read_span(17, "04 00 6B 00 03"_hex), kStart, 1s));
    EXPECT_FALSE(cache.find(*test::read_span(17, "03 00 6B 00 04"_hex), kStart, 1s));
}

TEST(ReadCache, P6AWriteForgetsWhatItMayChange) {
    struct Row {
        std::uint8_t station;
        Bytes request;
        bool kept;
    };
    const Row rows[] = {
        {17, "06 00 6B 00 01"_hex, false},
        {17, "06 00 6E 00 01"_hex, true},
        {17, "10 00 69 00 02 04 00 00 00 00"_hex, true},
        {17, "10 00 69 00 03 06 00 00 00 00 00 00"_hex, false},
        {17, "17 00 00 00 01 00 6D 00 01 02 00 00"_hex, false},
        {18, "06 00 6B 00 01"_hex, true},
        {0, "06 00 6B 00 01"_hex, false},
        {17, "05 04 00 FF 00"_hex, false},
        {17, "41 01"_hex, false},
    };
    for (const Row& row : rows) {
        ReadCache cache;
        cache.store(kSpan, kReply, TimePoint{});
        cache.on_write(kStart, row.station, test::request_of(row.request));
        EXPECT_EQ(cache.size(), row.kept ? 1u : 0u) << to_hex(row.request);
    }
}

TEST(ReadCache, IsBounded) {
    ReadCache cache;
    for (std::uint32_t i = 0; i < 3 * ReadCache::kEntries; ++i)
        cache.store({17, {kRegisters, 10 * i, 1}}, "03 02 00 00"_hex, TimePoint{});
    EXPECT_EQ(cache.size(), ReadCache::kEntries);
}

TEST(ReadCache, TheYoungestValueAnswers) {
    ReadCache cache;
    const Bytes newer = "03 06 00 01 00 02 00 03"_hex;
    cache.store(kSpan, kReply, kStart);
    cache.store(kSpan, newer, kStart + 1s);
    EXPECT_EQ(cache.size(), 1u) << "the older one is of no use any more";
    const auto hit = cache.find(kSpan, kStart + 3s, 1min);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->pdu, newer);
    EXPECT_EQ(hit->age, Duration(2s));
    cache.store(kSecond, "03 02 00 09"_hex, kStart + 2s);
    EXPECT_EQ(cache.find(kSecond, kStart + 3s, 1min).value().pdu, "03 02 00 09"_hex);
    EXPECT_EQ(cache.find(kSpan, kStart + 3s, 1min).value().pdu, newer)
        << "the wider one is kept for the rest";
}

TEST(ReadCache, P6WhatWasReadBeforeAWriteIsNotKeptWhenItComesBehindIt) {
    for (const std::uint8_t written : Bytes{17, 0, 18}) {
        const bool other = written == 18;
        ReadCache cache;
        cache.on_write(kStart, written, test::request_of(kWrite));
        cache.store(kSpan, kReply, kStart);
        EXPECT_EQ(cache.size(), other ? 1u : 0u) << "nobody knows which came first";
        cache.store(kSpan, kReply, kStart + 1ms);
        EXPECT_EQ(cache.size(), 1u);
    }
}

bool bit_of(std::uint32_t item) { return (item * item * 7 + item / 3) % 5 < 2; }
unsigned register_of(std::uint32_t item) { return (item * 40503 + 257) % 65536; }

/// What a panel answers whose items are known by their address.
Bytes panel_reply(const Span& span) {
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
void expect_slices(const Span& whole) {
    const Bytes reply = panel_reply(whole);
    for (std::uint32_t offset = 0; offset < whole.count; ++offset) {
        for (std::uint32_t count = 1; offset + count <= whole.count; ++count) {
            const Span part{whole.table, whole.first + offset, count};
            ASSERT_EQ(slice_reply(whole, reply, part), panel_reply(part))
                << label(whole.table) << ", " << count << " from " << offset;
        }
    }
}

TEST(SlicedReply, P6RegistersAreSlicedAtEveryOffset) {
    for (const Table table : {kRegisters, Table::input_registers}) {
        expect_slices({table, 0, 1});
        expect_slices({table, 65411, 125});
    }
}

TEST(SlicedReply, P6BitsAreSlicedAtEveryOffsetAndThoseBehindTheEndAreZero) {
    for (const Table table : {Table::coils, Table::discrete_inputs}) {
        for (const std::uint32_t count : {1U, 7U, 8U, 9U, 64U, 77U})
            expect_slices({table, 1003, count});
    }
    for (const Span& whole : {Span{Table::coils, 5, 2000}, Span{Table::discrete_inputs, 0, 1999}})
        EXPECT_EQ(slice_reply(whole, panel_reply(whole), whole), panel_reply(whole));
}

using Counts = std::map<Client, int>;

/// The waiting reads beside a list of them, which is searched from its start.
class WaitingReadsTest : public testing::Test {
  protected:
    struct Waiting {
        Job job;
        ReadSpan span;
    };
    void add(const Job& job, const ReadSpan& span) {
        reads.add(job, span, count());
        waiting.push_back({job, span});
    }
    void remove(std::size_t which) {
        reads.remove(waiting[which].job, waiting[which].span, count());
        waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(which));
    }
    WaitingReads::Count count() {
        return [this](Client client, int more) {
            counts[client] += more;
            if (counts[client] == 0) counts.erase(client);
        };
    }
    /// The oldest of a span that no other contains.
    bool should_count(const Waiting& one) const {
        return std::ranges::none_of(waiting, [&](const Waiting& other) {
            if (other.span == one.span) return other.job.ticket < one.job.ticket;
            return other.span.contains(one.span);
        });
    }
    bool carries_another(const Waiting& one) const {
        return std::ranges::any_of(waiting, [&](const Waiting& other) {
            return other.job.ticket != one.job.ticket && one.span.contains(other.span);
        });
    }
    void check() const {
        Counts expected;
        std::size_t all = 0;
        for (const Waiting& one : waiting) {
            const Ticket ticket = one.job.ticket;
            const bool should = should_count(one);
            ASSERT_EQ(reads.counts(ticket, one.span), should);
            ASSERT_EQ(reads.frees(ticket, one.span), should && !carries_another(one));
            if (!should) continue;
            ++expected[one.job.client];
            ++all;
        }
        ASSERT_EQ(counts, expected);
        ASSERT_EQ(reads.counting(), all);
    }

    WaitingReads reads;
    std::vector<Waiting> waiting;
    Counts counts;
};

TEST_F(WaitingReadsTest, AnyOrderOfComingAndGoingCountsTheSame) {
    std::mt19937 random(3);
    const auto below = [&](unsigned limit) { return static_cast<std::uint32_t>(random() % limit); };
    const modbus::Request request = test::request_of(kRead);
    Jobs gone;  // one may come back: older than those that came meanwhile
    Ticket ticket = 0;
    for (int i = 0; i < 4000 && !HasFatalFailure(); ++i) {
        const Table table = below(2) == 0 ? kRegisters : Table::input_registers;
        const ReadSpan span{1, {table, below(12), 1 + below(8)}};
        const auto holds = [&](const Waiting& one) { return one.span.contains(span); };
        ASSERT_EQ(reads.carries(span), std::ranges::any_of(waiting, holds));
        if (waiting.size() < 12 && below(5) < 3) {
            Job job{.ticket = ++ticket, .request = request, .client = 1 + below(3)};
            if (!gone.empty() && below(4) == 0) std::swap(job, gone.back());
            add(job, span);
        } else if (!waiting.empty()) {
            const std::size_t which = below(static_cast<unsigned>(waiting.size()));
            gone.push_back(waiting[which].job);
            remove(which);
        }
        check();
    }
}

}  // namespace
}  // namespace panelgate::arbiter::read_cache_test
