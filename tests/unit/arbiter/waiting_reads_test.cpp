#include "panelgate/arbiter/read_cache.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <random>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "support/read_span.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::waiting_reads_test {
namespace {

using Counts = std::map<Client, int>;

class WaitingReadsTest : public testing::Test {
  protected:
    static ReadSpan span(unsigned first, unsigned count, unsigned function = 3) {
        return *test::read_span(1, Writer().u8(function).u16(first).u16(count).take());
    }
    struct Waiting {
        Job job;
        ReadSpan span;
    };
    Job job(Client client) {
        const Bytes read = Writer().u8(3).u16(0).u16(1).take();  // its span is passed separately
        return {.ticket = ++ticket, .request = test::request_of(read), .client = client};
    }
    void add(const Job& job, const ReadSpan& span) {
        reads.add(job, span, count());
        waiting.push_back({job, span});
        check();
    }
    Job add(Client client, const ReadSpan& span) {
        const Job made = job(client);
        add(made, span);
        return made;
    }
    void remove(std::size_t which) {
        reads.remove(waiting[which].job, waiting[which].span, count());
        waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(which));
        check();
    }
    WaitingReads::Count count() {
        return [this](Client client, int more) {
            counts[client] += more;
            if (counts[client] == 0) counts.erase(client);
        };
    }
    /// The reads that should count, recomputed.
    bool should_count(const Waiting& one) const {
        return std::ranges::none_of(waiting, [&](const Waiting& other) {
            if (other.span == one.span) return other.job.ticket < one.job.ticket;
            return other.span.contains(one.span);
        });
    }
    void check() {
        Counts expected;
        std::size_t all = 0;
        for (const Waiting& one : waiting) {
            ASSERT_EQ(reads.counts(one.job.ticket, one.span), should_count(one));
            if (!should_count(one)) continue;
            ++expected[one.job.client];
            ++all;
        }
        ASSERT_EQ(counts, expected);
        ASSERT_EQ(reads.counting(), all);
        ASSERT_TRUE(reads.consistent());
    }

    WaitingReads reads;
    std::vector<Waiting> waiting;
    Counts counts;
    Ticket ticket = 0;
};

TEST_F(WaitingReadsTest, OfEqualOnesTheOldestCounts) {
    add(1, span(10, 2));
    add(2, span(10, 2));
    EXPECT_EQ(counts, (Counts{{1, 1}}));
    remove(0);
    EXPECT_EQ(counts, (Counts{{2, 1}}));
    remove(0);
    EXPECT_TRUE(counts.empty());
}

TEST_F(WaitingReadsTest, AnOlderOneThatComesBackCountsInstead) {
    const Job older = job(1);
    add(2, span(10, 2));
    add(older, span(10, 2));
    EXPECT_EQ(counts, (Counts{{1, 1}}));
}

TEST_F(WaitingReadsTest, WhatAWiderOneAnswersRides) {
    add(1, span(10, 10));
    EXPECT_TRUE(reads.carries(span(12, 3)));
    EXPECT_TRUE(reads.carries(span(10, 10)));
    EXPECT_FALSE(reads.carries(span(12, 9)));
    EXPECT_FALSE(reads.carries(span(9, 2)));
    EXPECT_FALSE(reads.carries(span(12, 3, 4))) << "another table";
    add(2, span(12, 3));
    add(3, span(17, 3));
    EXPECT_EQ(counts, (Counts{{1, 1}}));
}

TEST_F(WaitingReadsTest, AWiderOneTakesThePlaceOfAllItAnswersUntilItIsGone) {
    add(1, span(12, 3));
    add(2, span(16, 2));
    add(3, span(30, 1));
    add(4, span(10, 10));
    EXPECT_EQ(counts, (Counts{{3, 1}, {4, 1}}));
    remove(3);
    EXPECT_EQ(counts, (Counts{{1, 1}, {2, 1}, {3, 1}}));
}

TEST_F(WaitingReadsTest, OnesThatOnlyOverlapCountBoth) {
    add(1, span(10, 5));
    add(2, span(12, 5));
    EXPECT_EQ(reads.counting(), 2u);
}

TEST_F(WaitingReadsTest, OneFreesAPlaceIfNoOtherCountsInstead) {
    const Job first = add(1, span(10, 10));
    EXPECT_TRUE(reads.frees(first.ticket, span(10, 10)));
    const Job rider = add(2, span(12, 3));
    EXPECT_FALSE(reads.frees(first.ticket, span(10, 10)));
    EXPECT_FALSE(reads.frees(rider.ticket, span(12, 3))) << "it does not count";
    remove(1);
    const Job equal = add(3, span(10, 10));
    EXPECT_FALSE(reads.frees(first.ticket, span(10, 10)));
    EXPECT_FALSE(reads.frees(equal.ticket, span(10, 10)));
    remove(1);
    add(4, span(12, 9));
    EXPECT_TRUE(reads.frees(first.ticket, span(10, 10))) << "the other counts anyway";
}

TEST_F(WaitingReadsTest, AnyOrderOfComingAndGoingCountsTheSame) {
    std::mt19937 random(3);
    for (int i = 0; i < 4000 && !HasFatalFailure(); ++i) {
        if (waiting.size() < 12 && random() % 5 < 3) {
            add(1 + random() % 3, span(random() % 12, 1 + random() % 8, 3 + random() % 2));
        } else if (!waiting.empty()) {
            remove(random() % waiting.size());
        }
    }
}

}  // namespace
}  // namespace panelgate::arbiter::waiting_reads_test
