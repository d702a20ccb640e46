#include "panelgate/arbiter/schedule.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "support/hex.hpp"
#include "support/queue_fixture.hpp"

namespace panelgate::arbiter::schedule_test {
namespace {

constexpr TimePoint kStart{1h};

/// What waits for its first turn, and what goes again.
class BacklogTest : public test::QueueFixture {
  protected:
    /// Waits for its first turn.
    Ticket wait(Job job) {
        const Ticket ticket = job.ticket;
        EXPECT_TRUE(backlog_.queue().push(std::move(job)).taken);
        return ticket;
    }
    /// Was sent, and goes again.
    void retry(Jobs jobs) {
        Group group{
            .station = jobs.front().station, .request = jobs.front().request, .attempts = 1};
        group.jobs = std::move(jobs);
        backlog_.retry(std::move(group));
    }
    static Job until(Job job, TimePoint start_by, TimePoint deadline) {
        job.start_by = start_by;
        job.deadline = deadline;
        return job;
    }

    Backlog backlog_{QueueSettings{}};
};

TEST_F(BacklogTest, P2ACancelledClientHasNothingLeftAndTheOthersOfASharedRetryHave) {
    const Job shared = read(1, 17);
    const Job other = read(2, 17);
    const Ticket waits = wait(read(1, 18));
    wait(read(2, 18));
    retry({shared, other});
    retry({read(1, 19)});
    const auto cancelled = tickets(backlog_.cancel(1));
    EXPECT_EQ(cancelled.size(), 3u);
    EXPECT_EQ(cancelled.front(), waits);
    EXPECT_FALSE(backlog_.has(1, 17) || backlog_.has(1, 18) || backlog_.has(1, 19));
    EXPECT_TRUE(backlog_.has(2, 17) && backlog_.has(2, 18));
    EXPECT_FALSE(backlog_.has_retry(19)) << "nobody waits for it any more";
    EXPECT_TRUE(backlog_.cancel(1).empty());
}

/// Clients that left while the request was on the wire are still among the retry's jobs.
TEST_F(BacklogTest, P2ARetryEndsWithTheLastClientThatWaitsForIt) {
    Job left = read(1, 17);
    left.gone = true;
    retry({read(2, 17), left, read(3, 17)});
    EXPECT_EQ(backlog_.cancel(2).size(), 1u);
    EXPECT_TRUE(backlog_.has_retry(17));
    EXPECT_EQ(backlog_.cancel(3).size(), 2u) << "each is answered";
    EXPECT_FALSE(backlog_.has_retry(17));
    EXPECT_EQ(backlog_.take_dropped().size(), 1u);
    EXPECT_TRUE(backlog_.take_dropped().empty());
    left = read(1, 18);
    left.gone = true;
    left.deadline = kStart + 9s;
    retry({until(read(2, 18), kStart, kStart + 1s), left});
    EXPECT_EQ(backlog_.expire(kStart + 1s).size(), 2u);
    EXPECT_TRUE(backlog_.empty());
}

TEST_F(BacklogTest, P3WhatWasSentExpiresOnlyAtItsDeadlineEachJobAtItsOwn) {
    const Job first = until(read(1, 17), kStart + 1s, kStart + 2s);
    const Job second = until(read(2, 17), kStart + 1s, kStart + 4s);
    retry({first, second});
    EXPECT_EQ(backlog_.first_expiry(), kStart + 2s);
    EXPECT_TRUE(backlog_.expire(kStart + 2s - 1ns).empty());
    EXPECT_EQ(tickets(backlog_.expire(kStart + 2s)), std::vector<Ticket>{first.ticket});
    EXPECT_TRUE(backlog_.has_retry(17)) << "one still waits for it";
    EXPECT_EQ(tickets(backlog_.expire(kStart + 4s)), std::vector<Ticket>{second.ticket});
    EXPECT_FALSE(backlog_.has_retry(17));
    EXPECT_FALSE(backlog_.first_expiry());
}

TEST_F(BacklogTest, P7GivesEverythingWhenItIsCleared) {
    wait(read(1, 17));
    wait(write(2, 18));
    retry({read(3, 17), read(4, 17)});
    EXPECT_EQ(backlog_.clear().size(), 4u);
    EXPECT_TRUE(backlog_.empty());
    EXPECT_TRUE(backlog_.clear().empty());
}

}  // namespace
}  // namespace panelgate::arbiter::schedule_test
