#include "panelgate/arbiter/queue/job_queue.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/base/bytes.hpp"
#include "support/hex.hpp"
#include "support/queue_fixture.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::job_queue_test {
namespace {

using test::any;
using testing::ElementsAre;

/// Whose turn it is.
using JobQueueTest = test::QueueFixture;

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
        const Job popped = queue_.take(queue_.choose(any));
        if (popped.priority != PriorityClass::read) continue;
        ++reads[popped.client];
        add(read(popped.client, popped.station, popped.host));
    }
    EXPECT_EQ(reads[1], 10);
    EXPECT_EQ(reads[2], 10);
}

TEST_F(JobQueueTest, P9AReaderGetsEveryFifthTurnBesideEndlessWrites) {
    add(read(1, 1));
    for (int turn = 1; turn <= 50; ++turn) {
        add(write(2, 1));
        const Job popped = queue_.take(queue_.choose(any));
        EXPECT_EQ(popped.priority == PriorityClass::read, turn % 5 == 0);
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
            const Job popped = queue_.take(queue_.choose(any));
            EXPECT_EQ(popped.priority == PriorityClass::poll, turn % 10 == 0);
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
            const Job popped = queue_.take(queue_.choose(may_run));
            since = popped.priority == steady ? 0 : since + 1;
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
    EXPECT_THAT(tickets(queue_.take_reads(1, backwards)), ElementsAre(last, middle, first));
}

/// What goes when it is full, and what counts.
class JobQueueLimits : public test::QueueFixture {
  protected:
    /// Ticket of the dropped job, 0: none; the newcomer was taken.
    Ticket shed_for(Job job) {
        const auto pushed = queue_.push(std::move(job));
        EXPECT_TRUE(pushed.taken);
        return pushed.shed.empty() ? 0 : pushed.shed.front().ticket;
    }
    bool refuses(Job job) {
        const auto pushed = queue_.push(std::move(job));
        EXPECT_TRUE(pushed.taken || pushed.shed.empty());
        return !pushed.taken;
    }
    /// "w1/2@100" comes: a write of client 1, of host 100, to station 2. "!w1/2": it is refused;
    /// "w1/2-3": the third one is dropped for it.
    void come(const std::string& word) {
        SCOPED_TRACE(word);
        std::istringstream in(word.substr(word.find_first_not_of('!')));
        char what = 0;
        char mark = 0;
        Client client = 0;
        unsigned station = 0;
        Host host = 0;
        Ticket shed = 0;
        in >> what >> client >> mark >> station;
        while (in >> mark) in >> (mark == '@' ? host : shed);
        const auto priority = static_cast<PriorityClass>(std::string_view("wrp").find(what));
        Job made = job(host, client, static_cast<std::uint8_t>(station), priority);
        if (word.front() == '!') {
            EXPECT_TRUE(refuses(std::move(made)));
        } else {
            EXPECT_EQ(shed_for(std::move(made)), shed);
        }
    }
};

TEST_F(JobQueueLimits, P9WhoComesWhenItIsFullIsRefusedOrTakesThePlaceOfAnother) {
    struct Row {
        std::size_t limit;
        std::size_t per_client;
        std::string comes;
    };
    const Row rows[] = {
        // More than one client may have; more than the limit, when all have the same.
        {10, 2, "r1/1 r1/2 !r1/3 !w1/3 r2/3"},
        {4, 4, "r1/1 r2/1 r3/1 r4/1 !r5/1 !r1/1"},
        // The newest of the greediest host goes.
        {6, 6, "r1/1@100 r2/1@100 r2/1@100 r2/2@100 r1/1@100 r3/1@200 r4/1@300-4"},
        // Polls go before reads, and reads before writes: half of the queue is not more than half.
        {4, 4, "w1/1 p1/2 r1/3 w1/4 r2/1-2 w3/1-3 !r4/1 !r2/2"},
        // A write goes for a read only where one host holds more than half.
        {4, 4, "w1/1 w1/2 w1/3 r2/1 r3/1-3 !r4/1"},
        // A write takes the place of a read, even of its own.
        {3, 4, "r1/1 w1/2 r1/3 !r1/4 w1/4-3"},
        // A flood of writes does not drop the reads of clients with less.
        {6, 6, "w1/1 w1/2 w1/3 w1/4 r2/1 r3/1 !w1/5"},
        // What goes is the newest of its lane, and nothing from before a broadcast.
        {4, 4, "p1/1 w1/1 r1/1 w1/1 w2/1-4 w3/1-3 w4/1-2 w5/1-1 !w6/1"},
        {3, 3, "r1/1 r1/2 w1/0 w2/1-3"},
    };
    for (const Row& row : rows) {
        limits(row.limit, row.per_client);
        ticket_ = 0;
        std::size_t kept = 0;
        std::istringstream words(row.comes);
        for (std::string word; words >> word;) {
            come(word);
            if (word.find_first_of("!-") == std::string::npos) ++kept;
        }
        EXPECT_EQ(queue_.size(), kept) << row.comes;
    }
}

/// Otherwise the same client would lose every time and never be served.
TEST_F(JobQueueLimits, P9OfEquallyGreedyClientsTheNewestRequestGoes) {
    limits(3, 4);
    const Ticket first = add(read(1, 1, 100));
    const Ticket second = add(read(3, 1, 100));
    const Ticket third = add(read(2, 1, 100));
    EXPECT_EQ(shed_for(read(8, 1, 200)), third);
    EXPECT_EQ(shed_for(read(9, 1, 300)), second);
    EXPECT_EQ(next(), first);
}

TEST_F(JobQueueLimits, P6EqualReadsCountOnce) {
    for (Client client = 1; client <= 1024; ++client)
        ASSERT_TRUE(queue_.push(read_of(client, "03 00 10 00 08"_hex)).taken);
    EXPECT_EQ(queue_.size(), 1u);
    EXPECT_EQ(queue_.waiting(), 1024u);
    queue_.take(queue_.choose(any));
    EXPECT_EQ(queue_.size(), 1u);
    EXPECT_EQ(queue_.take_reads(1, any).size(), 1023u);
    EXPECT_EQ(queue_.size(), 0u);
}

TEST_F(JobQueueLimits, P6AReadThatRidesIsTakenWhenTheQueueIsFull) {
    limits(2, 1);
    add(read_of(1, "03 00 10 00 08"_hex));
    add(read_of(2, "03 00 20 00 08"_hex));
    add(read_of(1, "03 00 20 00 08"_hex));
    add(read_of(3, "03 00 11 00 02"_hex));
    EXPECT_TRUE(refuses(read_of(3, "03 00 17 00 02"_hex)));
}

TEST_F(JobQueueLimits, NeverHoldsMoreThanItsMost) {
    const Bytes pdu = "03 00 10 00 08"_hex;
    for (std::size_t i = 0; i < JobQueue::kMost; ++i)
        ASSERT_TRUE(queue_.push(read_of(i % 640 + 1, pdu)).taken);
    EXPECT_TRUE(refuses(read_of(1, pdu)));
    EXPECT_TRUE(refuses(write(1, 1)));
    queue_.put_back(read_of(1, pdu));
    EXPECT_EQ(queue_.waiting(), JobQueue::kMost + 1);
}

/// Otherwise no client could read beside more writers than there are places.
TEST_F(JobQueueLimits, P9WritesLeaveAFifthOfThePlacesToReads) {
    limits(5, 5);
    for (Client client = 1; client <= 3; ++client) add(write(client, 1));
    const Ticket first = add(read(4, 1));
    const Ticket second = add(read(5, 1));
    EXPECT_EQ(shed_for(write(6, 1)), second);
    EXPECT_TRUE(refuses(write(7, 1)));
    for (int i = 0; i < 4; ++i) next();
    EXPECT_EQ(next(), first);
}

TEST_F(JobQueueLimits, P9AHostWhoseReadsAreAllDoubledStillMakesRoom) {
    limits(8, 8);
    for (unsigned i = 0; i < 8; ++i) {
        const Bytes pdu = Writer().u8(3).u16(10 * i).u16(1).take();
        for (Client client = 1; client <= 2; ++client) {
            Job job = read_of(client, pdu);
            job.host = 100;
            add(std::move(job));
        }
    }
    EXPECT_NE(shed_for(read(3, 1, 200)), 0u);
    EXPECT_EQ(queue_.size(), 8u);
}

/// 40 connections of one host, 16 requests each at once and again with every answer; a polite
/// client asks for one thing after the other.
void plays_beside_a_flood(Host flood, Host polite, PriorityClass priority) {
    JobQueue queue{QueueSettings{}};
    Ticket ticket = 0;
    std::map<Client, int> open;
    const auto ask = [&](Host host, Client client, PriorityClass as) {
        ++ticket;
        const auto address = static_cast<unsigned>(ticket * 7 % 60000);
        Job job{.ticket = ticket,
                .station = static_cast<std::uint8_t>(1 + ticket % 5),
                .request = test::request_of(Writer().u8(3).u16(address).u16(1).take()),
                .client = client,
                .host = host,
                .priority = as};
        auto pushed = queue.push(std::move(job));
        for (const Job& shed : pushed.shed) {
            EXPECT_NE(shed.client, 1000u);
            --open[shed.client];
        }
        if (pushed.taken) ++open[client];
        return pushed.taken;
    };
    constexpr Client kPolite = 1000;
    int longest = 0;
    for (int turn = 0, since = 0; turn < 500; ++turn) {
        for (Client client = 1; client <= 40; ++client) {
            while (open[client] < 16 && ask(flood, client, priority)) continue;
        }
        if (open[kPolite] == 0) {
            EXPECT_TRUE(ask(polite, kPolite, PriorityClass::read));
            since = 0;
        }
        longest = std::max(longest, ++since);
        --open[queue.take(queue.choose(any)).client];
    }
    EXPECT_LE(longest, flood == polite ? 42 : priority == PriorityClass::write ? 5 : 3);
}

TEST(JobQueueFlood, P9APoliteClientBesideAFloodingHostIsNeverRefused) {
    plays_beside_a_flood(100, 200, PriorityClass::read);
    plays_beside_a_flood(100, 200, PriorityClass::write);
}

TEST(JobQueueFlood, P9APoliteClientOfTheFloodingHostIsNotRefusedEither) {
    plays_beside_a_flood(100, 100, PriorityClass::read);
    plays_beside_a_flood(100, 100, PriorityClass::write);
}

}  // namespace
}  // namespace panelgate::arbiter::job_queue_test
