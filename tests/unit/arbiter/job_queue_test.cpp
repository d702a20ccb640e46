#include "panelgate/arbiter/job_queue.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "support/queue_fixture.hpp"

namespace panelgate::arbiter::job_queue_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using test::any;
using JobQueueTest = test::QueueFixture;

TEST_F(JobQueueTest, WritesGoBeforeReadsAndReadsBeforePolls) {
    const Ticket poll_ = add(poll(1, 1));
    const Ticket read_ = add(read(2, 1));
    const Ticket write_ = add(write(3, 1));
    EXPECT_THAT(drain(), ElementsAre(write_, read_, poll_));
    EXPECT_TRUE(queue_.empty());
}

TEST_F(JobQueueTest, ALaneKeepsItsOrderWhateverItsClasses) {
    const Ticket first = add(read(1, 7));
    const Ticket second = add(write(1, 7));
    const Ticket other = add(write(1, 8));
    EXPECT_THAT(drain(), ElementsAre(other, first, second));
}

TEST_F(JobQueueTest, StationsOfOneClientDoNotWaitForEachOther) {
    add(read(1, 7));
    const Ticket other = add(read(1, 8));
    EXPECT_EQ(next([](const Job& job) { return job.station != 7; }), other);
    EXPECT_EQ(next([](const Job& job) { return job.station != 7; }), 0u);
}

TEST_F(JobQueueTest, ABroadcastWaitsForOlderJobsAndDelaysYoungerOnes) {
    const Ticket older = add(read(1, 7));
    const Ticket broadcast = add(write(1, 0));
    const Ticket younger = add(write(1, 8));
    const Ticket of_other_client = add(read(2, 7));
    std::vector<Ticket> first;
    queue_.any_first([&](const Job& job) {
        first.push_back(job.ticket);
        return false;
    });
    EXPECT_THAT(first, ElementsAre(older, of_other_client));
    EXPECT_THAT(drain(), ElementsAre(older, broadcast, younger, of_other_client));
}

TEST_F(JobQueueTest, AJobBehindABroadcastIsNotTakenAlong) {
    add(write(1, 0));
    add(read(1, 7));
    const Ticket free = add(read(2, 7));
    EXPECT_THAT(tickets(queue_.take_all(7, any)), ElementsAre(free));
}

TEST_F(JobQueueTest, P9HostsTakeTurnsThenTheirClientsThenTheirStations) {
    const Ticket a1 = add(read(1, 1, 100));
    const Ticket a2 = add(read(1, 1, 100));
    const Ticket a3 = add(read(1, 2, 100));
    const Ticket b1 = add(read(2, 1, 100));
    const Ticket c1 = add(read(3, 1, 200));
    const Ticket c2 = add(read(3, 1, 200));
    const Ticket c3 = add(read(3, 1, 200));
    EXPECT_THAT(drain(), ElementsAre(a1, c1, b1, c2, a3, c3, a2));
}

TEST_F(JobQueueTest, P9AHostThatWritesMuchReadsInTurn) {
    add(read(1, 2, 100));
    add(read(2, 1, 200));
    std::map<Client, int> reads;
    for (int i = 0; i < 100; ++i) {
        if (!queue_.has(1, 1)) add(write(1, 1, 100));
        const auto popped = queue_.pop(any);
        if (popped->priority != PriorityClass::read) continue;
        ++reads[popped->client];
        add(read(popped->client, popped->station, popped->host));
    }
    EXPECT_EQ(reads[1], 10);
    EXPECT_EQ(reads[2], 10);
}

TEST_F(JobQueueTest, P9AReaderGetsEveryFifthTurnBesideEndlessWrites) {
    add(read(1, 1));
    for (int turn = 1; turn <= 50; ++turn) {
        add(write(2, 1));
        const auto popped = queue_.pop(any);
        ASSERT_TRUE(popped);
        EXPECT_EQ(popped->priority == PriorityClass::read, turn % 5 == 0);
        EXPECT_EQ(queue_.last_was_passed_over(), turn % 5 == 0);
        if (turn % 5 == 0) add(read(1, 1));
    }
}

TEST_F(JobQueueTest, P9APollGetsEveryTenthTurnBesideReadsOrWrites) {
    for (const PriorityClass other : {PriorityClass::write, PriorityClass::read}) {
        queue_ = JobQueue(QueueSettings{});
        add(poll(1, 1));
        for (int turn = 1; turn <= 50; ++turn) {
            add(job(0, 2, 1, other));
            const auto popped = queue_.pop(any);
            ASSERT_TRUE(popped);
            EXPECT_EQ(popped->priority == PriorityClass::poll, turn % 10 == 0);
            if (turn % 10 == 0) add(poll(1, 1));
        }
    }
}

/// Runnable or not at random: a job that was always runnable got its turn.
TEST_F(JobQueueTest, P9NoJobWaitsLongerThanItsTurnsWhateverTheOthersMay) {
    for (const PriorityClass steady : {PriorityClass::read, PriorityClass::poll}) {
        queue_ = JobQueue(QueueSettings{});
        unsigned random = 1;
        int since = 0;
        int overtaken_in_a_row = 0;
        for (int i = 0; i < 200'000; ++i) {
            for (const auto c : {PriorityClass::write, PriorityClass::read, PriorityClass::poll}) {
                const auto station = static_cast<std::uint8_t>(static_cast<int>(c) + 1);
                if (!queue_.has(1, station)) queue_.push(job(0, 1, station, c));
            }
            random = random * 1664525u + 1013904223u;
            const unsigned bits = random >> 28;
            const auto may_run = [&](const Job& job) {
                if (job.priority == steady) return true;
                return (bits >> static_cast<unsigned>(job.priority) & 1u) != 0;
            };
            const auto popped = queue_.pop(may_run);
            since = popped->priority == steady ? 0 : since + 1;
            ASSERT_LT(since, steady == PriorityClass::read ? 5 : 10);
            overtaken_in_a_row = queue_.last_was_passed_over() ? overtaken_in_a_row + 1 : 0;
            ASSERT_LT(overtaken_in_a_row, 2);
        }
    }
}

TEST_F(JobQueueTest, P9AWriteThatIsAloneStartsWithinTwoTurns) {
    for (int before = 0; before < 40; ++before) {
        queue_ = JobQueue(QueueSettings{});
        for (int i = 0; i < 30; ++i) {
            add(read(1, 1));
            add(poll(2, 1));
        }
        for (int i = 0; i < before; ++i) next();
        const Ticket urgent = add(write(3, 1));
        const Ticket first = next();
        EXPECT_TRUE(first == urgent || next() == urgent);
    }
}

TEST_F(JobQueueTest, AJobPutBackGoesAheadOfItsLaneAndIsNeverRefused) {
    limits(2, 2);
    const Ticket first = add(read(1, 1));
    const Ticket second = add(read(1, 1));
    Jobs taken = queue_.take_all(1, any);
    const Ticket third = add(read(1, 1));
    const Ticket fourth = add(read(1, 1));
    for (Job& job : taken) queue_.put_back(std::move(job));
    EXPECT_EQ(queue_.size(), 4u);
    EXPECT_THAT(drain(), ElementsAre(first, second, third, fourth));
}

TEST_F(JobQueueTest, TakesAllThatMatchWhileTheyAreFirst) {
    const Ticket a = add(read(1, 1));
    const Ticket b = add(read(2, 1));
    const Ticket c = add(read(1, 1));
    add(write(2, 1));
    add(read(2, 1));
    add(read(3, 2));
    const auto reads = [](const Job& job) { return job.priority == PriorityClass::read; };
    EXPECT_THAT(tickets(queue_.take_all(1, reads)), ElementsAre(a, b, c));
    EXPECT_TRUE(queue_.consistent());
    EXPECT_EQ(queue_.waiting(), 3u);
}

TEST_F(JobQueueTest, AsksAgainAfterEachThatWasTaken) {
    const Ticket last = add(read(2, 1));
    const Ticket middle = add(read(1, 1));
    const Ticket first = add(read(3, 1));
    Ticket wanted = first;
    const auto backwards = [&](const Job& job) {
        if (job.ticket != wanted) return false;
        --wanted;
        return true;
    };
    EXPECT_THAT(tickets(queue_.take_all(1, backwards)), ElementsAre(last, middle, first));
}

TEST_F(JobQueueTest, RemovesInOrderOfTickets) {
    const Ticket a = add(read(9, 1, 50));
    add(read(1, 1));
    const Ticket b = add(write(9, 2, 50));
    const Ticket c = add(read(9, 1, 50));
    const auto theirs = [](const Job& job) { return job.client == 9; };
    EXPECT_THAT(tickets(queue_.remove_if(theirs)), ElementsAre(a, b, c));
    EXPECT_THAT(queue_.remove_if(theirs), IsEmpty());
    EXPECT_TRUE(queue_.consistent());
    EXPECT_EQ(queue_.size(), 1u);
}

TEST_F(JobQueueTest, KnowsWhatWaitsForAStation) {
    add(read(1, 7));
    EXPECT_TRUE(queue_.has(1, 7));
    EXPECT_FALSE(queue_.has(1, 8));
    EXPECT_FALSE(queue_.has(2, 7));
    add(write(1, 0));
    EXPECT_TRUE(queue_.has(1, 8));
}

TEST_F(JobQueueTest, KnowsTheEarliestMomentAtWhichOneIsTooLate) {
    EXPECT_FALSE(queue_.first_expiry());
    for (const Duration at : {5s, 3s, 4s}) {
        Job late = read(1, 1);
        late.start_by = TimePoint{at};
        add(std::move(late));
    }
    EXPECT_EQ(queue_.first_expiry(), TimePoint{3s});
    queue_.remove_if([](const Job& job) { return job.start_by == TimePoint{3s}; });
    EXPECT_EQ(queue_.first_expiry(), TimePoint{4s});
}

}  // namespace
}  // namespace panelgate::arbiter::job_queue_test
