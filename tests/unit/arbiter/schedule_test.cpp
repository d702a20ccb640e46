#include "panelgate/arbiter/schedule.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "support/attempts.hpp"
#include "support/hex.hpp"
#include "support/queue_fixture.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::schedule_test {
namespace {

constexpr std::array<std::uint8_t, 3> kIds{1, 2, 3};
constexpr Duration kCheap = 20ms;
constexpr Duration kDear = 500ms;

Settings three_stations() {
    Settings settings;
    settings.serial = {38400, 8, Parity::none, 1};
    for (const std::uint8_t id : kIds) {
        settings.stations.push_back(settings.unlisted);
        settings.stations.back().id = id;
    }
    return settings;
}

/// A line with the stations 1 to 3 that has been quiet for long.
class ScheduleTest : public testing::Test {
  protected:
    void rebuild() {
        schedule = Schedule(settings);
        echo = EchoMemory(settings.echo);
    }
    static Bytes read_of(unsigned address) { return Writer().u8(3).u16(address).u16(1).take(); }
    /// A read or a write of its own client, that touches no other one.
    Job job(std::uint8_t station, bool write = false) {
        const auto address = static_cast<unsigned>(10 * ++ticket);
        const Bytes pdu = write ? Writer().u8(6).u16(address).u16(1).take() : read_of(address);
        return {.ticket = ticket,
                .station = station,
                .request = test::request_of(pdu),
                .client = ticket,
                .priority = write ? PriorityClass::write : PriorityClass::read,
                .deadline = now + 1h,
                .start_by = now + 1h};
    }
    Ticket wait(std::uint8_t station, bool write = false) {
        Job made = job(station, write);
        const Ticket given = made.ticket;
        EXPECT_TRUE(schedule.backlog().queue().push(std::move(made)).taken);
        return given;
    }
    Group failed(std::uint8_t station) {
        const Job one = job(station);
        stations.of(station);
        return {.jobs = {one}, .station = station, .request = one.request, .attempts = 1};
    }
    Schedule::Next next() { return schedule.next(now, stations, quiet, echo); }
    /// The stations asked, in order: "2 1 r3", r for retries.
    std::string order(std::size_t most = 99) {
        std::string text;
        for (; most > 0; --most) {
            const auto group = next().group;
            if (!group) break;
            text += (text.empty() ? "" : " ") + std::string(group->attempts > 0 ? "r" : "") +
                    std::to_string(group->station);
        }
        return text;
    }
    void kill(std::uint8_t id) {
        while (!stations.health(id).offline()) {
            stations.on_failed(now, test::group_of(id, "03 00 6B 00 01"_hex), Verdict::silent,
                               100ms);
            stations.of(id).on_given_up(now, Fault::timeout);
        }
    }

    Settings settings = three_stations();
    TimePoint now{1h};
    Ticket ticket = 0;
    Stations stations{settings};
    Quiet quiet{1s, 2ms};
    EchoMemory echo{EchoMode::off};
    Schedule schedule{settings};
};

TEST_F(ScheduleTest, NothingGoesBeforeTheGapBehindTheLastBitIsOver) {
    quiet.on_sent(now, 1);
    wait(2);
    EXPECT_FALSE(next().group);
    now += stations.gap(1) - 1ns;
    EXPECT_FALSE(next().group);
    EXPECT_EQ(schedule.next_start(stations, quiet), now + 1ns);
    now += 1ns;
    EXPECT_EQ(order(), "2");
    EXPECT_FALSE(schedule.next_start(stations, quiet)) << "nothing waits";
}

TEST_F(ScheduleTest, P4ARetryLeavesTheOthersTurnsByWhatItMayCost) {
    struct Row {
        std::vector<std::uint8_t> waiting;
        Duration patience;
        std::string asked;  ///< at first
        Quarantine quarantine = Quarantine::automatic;
    };
    const Row rows[] = {
        {{}, kCheap, "r1"},                            // nobody else wants the line
        {{2, 2, 3}, kCheap, "2 r1"},                   // one turn
        {{2, 3, 2}, kDear, "2 3 r1 2"},                // one for each of the stations that waited
        {{2, 2, 2, 2, 2, 2, 3}, kDear, "2 3 r1 2 2"},  // also where one has many clients
        {{2}, kDear, "r1 2", Quarantine::line},        // the whole line rests: it goes first
    };
    for (const Row& row : rows) {
        settings.quarantine = row.quarantine;
        rebuild();
        for (const std::uint8_t station : row.waiting) wait(station);
        schedule.retry(now, failed(1), row.patience, stations);
        const auto turns = static_cast<std::size_t>(std::ranges::count(row.asked, ' ')) + 1;
        EXPECT_EQ(order(turns), row.asked);
    }
}

TEST_F(ScheduleTest, P4ARetriedWriteLeavesOneTurnToTheOthers) {
    wait(2);
    wait(3);
    Group write = failed(1);
    write.request = job(1, true).request;
    schedule.retry(now, std::move(write), kDear, stations);
    EXPECT_EQ(order(), "2 r1 3");
}

TEST_F(ScheduleTest, P8TheReadThatConfirmsAWriteGoesBeforeTheOthers) {
    wait(2);
    Group read = failed(1);
    read.confirms = Bytes{6, 0, 1, 0, 1};
    schedule.retry(now, std::move(read), {}, stations);
    EXPECT_EQ(order(), "r1 2") << "what they do meanwhile could change what it shows";
}

TEST_F(ScheduleTest, P4ADearRetryLeavesTheOthersNoMoreTimeThanItMayTake) {
    wait(2);
    wait(3);
    schedule.retry(now, failed(1), kDear, stations);
    EXPECT_EQ(order(1), "2");
    now += kDear;
    EXPECT_EQ(order(), "r1 3") << "what the others took counts";
}

TEST_F(ScheduleTest, P4RetriesThatAreDearTogetherLeaveEachOfTheOthersATurn) {
    for (const std::uint8_t station : Bytes{2, 3, 5}) wait(station);
    schedule.retry(now, failed(1), 150ms, stations);
    schedule.retry(now, failed(4), 150ms, stations);
    EXPECT_EQ(order(), "2 r1 3 5 r4");
}

TEST_F(ScheduleTest, P4BetweenTwoDearRetriesTheOthersHaveTheirTurns) {
    wait(2);
    wait(2);
    schedule.retry(now, failed(1), kDear, stations);
    schedule.retry(now, failed(3), kDear, stations);
    EXPECT_EQ(order(1), "2");
    Group silent = *next().group;
    now += kDear;
    ++silent.attempts;
    schedule.retry(now, std::move(silent), kDear, stations);
    EXPECT_EQ(order(), "2 r3 r1");
}

/// Each station has one turn while a retry waits; a write that takes it counts for the reads that
/// it passes over.
TEST_F(ScheduleTest, P9AReaderWaitsForFourWritesAlsoBesideARetry) {
    wait(2);
    for (const std::uint8_t station : Bytes{2, 3, 2, 2, 2, 2, 2}) wait(station, true);
    schedule.retry(now, failed(1), kDear, stations);
    int writes = 0;
    while (const auto group = next().group) {
        if (group->attempts > 0) continue;
        if (group->request.is_read()) break;
        ++writes;
    }
    EXPECT_EQ(writes, 4);
}

/// ... and nobody has a turn for the sake of a retry that has gone with its client.
TEST_F(ScheduleTest, P9ARetryThatNobodyWaitsForAnyMoreReservesNoTurns) {
    for (int i = 0; i < 6; ++i) wait(2, true);
    Group retry = failed(1);
    const Client client = retry.jobs.front().client;
    schedule.retry(now, std::move(retry), kDear, stations);
    wait(3);
    EXPECT_EQ(schedule.backlog().cancel(client).size(), 1u);
    EXPECT_EQ(order(), "2 2 2 2 3 2 2");
}

/// While it rests after each reply the polls of another station have the turns of their class.
TEST_F(ScheduleTest, P9ReadsOfAStationThatSaysItsRepliesTwiceLeaveTurnsToItsPolls) {
    const Bytes reply = "03 02 00 07"_hex;
    stations.book().on_reply(1, now - 50ms, read_of(9999), reply);
    stations.of(1).on_unsolicited_frame(stations.book(), now, Done::duplicate, reply);
    now += 1s;
    Job poll = job(1);
    poll.priority = PriorityClass::poll;
    EXPECT_TRUE(schedule.backlog().queue().push(std::move(poll)).taken);
    std::string asked;
    for (int i = 0; i <= Station::kPollsPassedOver; ++i) {
        wait(1);
        const Group group = next().group.value();
        asked += group.is_poll() ? 'p' : 'r';
        stations.of(1).on_asked(stations.book(), now, group);
    }
    EXPECT_EQ(asked, "rrrp");
}

/// Its station has had its writes in a row, so that a read of it is due, which is the last of a
/// long round: that takes the write's turn, and does not hold it back until its own has come.
TEST_F(ScheduleTest, P9AWriteIsNotHeldBackByAReadWhoseHostHasOtherReads) {
    constexpr std::uint64_t kGreedy = 7;
    const auto wait_of_host = [&](std::uint8_t station, bool write, std::uint64_t host) {
        Job made = job(station, write);
        made.host = host;
        EXPECT_TRUE(schedule.backlog().queue().push(std::move(made)).taken);
    };
    for (int i = 0; i < 20; ++i) {
        wait_of_host(2, false, kGreedy);
        wait_of_host(3, true, kGreedy);
    }
    wait_of_host(1, false, kGreedy);
    wait_of_host(1, true, kGreedy + 1);
    for (int i = 0; i < Station::kWritesInARow; ++i)
        stations.of(1).on_asked(stations.book(), now, test::group_of(1, "06 00 01 00 01"_hex));
    std::string asked;
    while (const auto group = next().group) {
        if (group->station == 1) asked += group->request.is_read() ? "r" : "w";
        stations.of(group->station).on_asked(stations.book(), now, *group);
        if (asked.ends_with('w')) break;
        asked += '.';
        ASSERT_LT(asked.size(), 8u) << asked;
    }
    EXPECT_TRUE(asked.ends_with("w")) << asked;
    EXPECT_NE(asked.find('r'), std::string::npos) << asked;
}

TEST_F(ScheduleTest, NothingElseGoesToAStationBeforeItsRetry) {
    wait(1, true);
    wait(1);
    schedule.retry(now, failed(1), kCheap, stations);
    EXPECT_EQ(order(), "r1 1 1");
}

TEST_F(ScheduleTest, P1AStationWithAnOutstandingReplyIsPassedOver) {
    wait(1);
    wait(2);
    stations.of(1).replies().on_unanswered(stations.book(), now, read_of(9999), now - 500ms);
    EXPECT_EQ(order(), "2");
    EXPECT_EQ(schedule.next_start(stations, quiet), stations.of(1).replies().rested());
    now = stations.of(1).replies().rested();
    EXPECT_EQ(order(), "1");
}

TEST_F(ScheduleTest, P1WhileTheLineRestsNoStationIsAsked) {
    wait(2);
    quiet.quarantine(now, 1, now + 100ms);
    EXPECT_EQ(order(), "");
    EXPECT_EQ(schedule.next_start(stations, quiet), now + 100ms);
    now += 100ms;
    EXPECT_EQ(order(), "2");
}

TEST_F(ScheduleTest, P4AProbeGoesWhenTheLineIsFreeAndOnABusyOneWhenItHasWaited) {
    kill(1);
    now = *stations.next_probe() - 1ns;
    EXPECT_EQ(order(), "");
    now += 1ns;
    const Group probe = next().group.value();
    EXPECT_EQ(probe.station, 1);
    EXPECT_TRUE(probe.probe);
    EXPECT_TRUE(probe.jobs.empty()) << "nobody waits for it";
    wait(2);
    EXPECT_EQ(order(1), "2") << "who waits goes first";
    wait(2);
    now += 20ms;
    EXPECT_EQ(order(1), "1") << "but not for ever";
}

TEST_F(ScheduleTest, P8BeforeTheFirstWriteAReadShowsWhetherTheLineHasAnEcho) {
    settings.echo = EchoMode::automatic;
    rebuild();
    const Ticket write = wait(1, true);
    const Group reading = next().group.value();
    EXPECT_EQ(reading.learns_for, write);
    EXPECT_TRUE(reading.jobs.empty());
    EXPECT_EQ(reading.request.function(), 3);
    echo.on_unclear();
    const Group writing = next().group.value();
    ASSERT_EQ(writing.jobs.size(), 1u) << "what did not tell is not asked for ever";
    EXPECT_EQ(writing.request.function(), 6);
    EXPECT_EQ(writing.jobs.front().ticket, write);
}

TEST_F(ScheduleTest, P1OnALineThatMayStallOutstandingRepliesNeedAReopening) {
    settings.may_stall = true;
    rebuild();
    wait(1);
    stations.of(1).replies().on_unanswered(stations.book(), now, read_of(9999), now - 500ms);
    now = stations.of(1).replies().rested();
    EXPECT_TRUE(next().reopen);
    stations.book().on_opened(now);
    const auto proof = next();
    ASSERT_TRUE(proof.group) << "a connection proves nothing";
    EXPECT_TRUE(proof.group->probe);
    EXPECT_NE(proof.group->request.reply_length(), test::request_of(read_of(9999)).reply_length())
        << "no reply to one is one to the other";
    stations.book().on_proved(now);
    const auto proved = next();
    EXPECT_FALSE(proved.reopen) << "something that was sent later has been answered";
    ASSERT_TRUE(proved.group);
    EXPECT_FALSE(proved.group->probe);
}

TEST_F(ScheduleTest, P1TheWholeLineRestsWhereTheConfigurationSaysSo) {
    const Group group = failed(1);
    Station& station = stations.of(1);
    station.replies().on_unanswered(stations.book(), now, group.request.pdu(), now - 500ms);
    EXPECT_FALSE(schedule.line_rests_until(now, group, now - 500ms, station))
        << "its replies have never been late";
    settings.quarantine = Quarantine::line;
    rebuild();
    EXPECT_EQ(schedule.line_rests_until(now, group, now - 500ms, station),
              station.replies().rested());
    Group probe = group;
    probe.probe = true;
    EXPECT_FALSE(schedule.line_rests_until(now, probe, now - 500ms, station))
        << "a probe lets the others go on";
    for (StationSettings& one : settings.stations) one.late_window = 2s;
    stations.apply(settings);
    station.replies().on_unanswered(stations.book(), now, group.request.pdu(), now - 500ms);
    EXPECT_EQ(schedule.line_rests_until(now, group, now - 500ms, station), now + 2s);
    for (StationSettings& one : settings.stations) one.adaptive_timeout = true;
    stations.apply(settings);
    EXPECT_EQ(schedule.line_rests_until(now, group, now - 500ms, station), now + 500ms)
        << "who shortens the timeout does not want to wait for longer than one";
}

TEST_F(ScheduleTest, P1TheWholeLineRestsForAStationWhoseRepliesAreOftenLate) {
    Group group = failed(1);
    group.first_silence = true;
    Station& station = stations.of(1);
    const auto miss = [&] {
        station.replies().on_unanswered(stations.book(), now, group.request.pdu(), now - 500ms);
        return schedule.line_rests_until(now, group, now - 500ms, station);
    };
    for (int times = 0; times < 2; ++times) {
        EXPECT_FALSE(miss()) << "once is no habit";
        now += 80ms;
        station.on_unsolicited_frame(stations.book(), now, Done::late,
                                     Bytes{3, 2, 0, static_cast<std::uint8_t>(times)});
    }
    EXPECT_EQ(miss(), now + 100ms) << "a quarter longer than the latest was late";
    group.first_silence = false;
    EXPECT_FALSE(miss()) << "the others do not wait for it again";
}

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
    /// Of the retry that is taken, 0 when none may go.
    int take(const std::function<bool(const Group&)>& may_go) {
        const auto group = backlog_.take_retry(may_go);
        return group ? group->station : 0;
    }

    Backlog backlog_{QueueSettings{}};
};

TEST_F(BacklogTest, TheOldestRetryThatMayGoIsTaken) {
    for (const std::uint8_t station : Bytes{17, 18, 19}) retry({read(1, station)});
    const auto not_17 = [](const Group& group) { return group.station != 17; };
    EXPECT_EQ(take([](const Group&) { return false; }), 0);
    EXPECT_EQ(take(not_17), 18);
    EXPECT_EQ(take(not_17), 19);
    EXPECT_EQ(take(not_17), 0);
    EXPECT_TRUE(backlog_.has_retries());
    EXPECT_EQ(take([](const Group&) { return true; }), 17);
    EXPECT_FALSE(backlog_.has_retries());
}

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

/// Clients that left while it was on the wire are still among its jobs.
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

TEST_F(BacklogTest, P3WhatWasNotSentExpiresWhenItCanNoLongerBeStarted) {
    const Ticket first = wait(until(read(1, 17), kStart + 1s, kStart + 5s));
    wait(until(read(2, 17), kStart + 2s, kStart + 3s));
    EXPECT_EQ(backlog_.first_expiry(), kStart + 1s);
    EXPECT_TRUE(backlog_.expire(kStart + 1s - 1ns).empty());
    EXPECT_EQ(tickets(backlog_.expire(kStart + 1s)), std::vector<Ticket>{first});
    EXPECT_EQ(backlog_.first_expiry(), kStart + 2s);
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

TEST_F(BacklogTest, OnlyWhatWaitsForItsFirstTurnIsRemoved) {
    const Ticket waits = wait(read(1, 17));
    retry({read(1, 17)});
    EXPECT_EQ(tickets(backlog_.queue().remove_if(test::any)), std::vector<Ticket>{waits});
    EXPECT_TRUE(backlog_.has_retry(17));
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
