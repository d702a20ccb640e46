#include "panelgate/arbiter/schedule.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <utility>

#include "panelgate/base/bytes.hpp"
#include "support/attempts.hpp"
#include "support/hex.hpp"
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

TEST_F(ScheduleTest, ARetryLeavesOneTurnToTheOthers) {
    schedule.retry(now, failed(1), kCheap);
    EXPECT_EQ(order(), "r1") << "nobody else wants the line";
    wait(2);
    wait(2);
    wait(3);
    schedule.retry(now, failed(1), kCheap);
    EXPECT_EQ(order(2), "2 r1");
}

TEST_F(ScheduleTest, P4ADearRetryLeavesATurnToEachStationThatWaited) {
    wait(2);
    wait(3);
    wait(2);
    schedule.retry(now, failed(1), kDear);
    EXPECT_EQ(order(), "2 3 r1 2");
}

TEST_F(ScheduleTest, P4ADearRetryLeavesTheOthersNoMoreTimeThanItMayTake) {
    wait(2);
    wait(3);
    schedule.retry(now, failed(1), kDear);
    EXPECT_EQ(order(1), "2");
    now += kDear;
    EXPECT_EQ(order(), "r1 3") << "what the others took counts";
}

TEST_F(ScheduleTest, P4AStationWithManyClientsDoesNotHaveAllTurnsBeforeALongRetry) {
    for (int i = 0; i < 6; ++i) wait(2);
    wait(3);
    schedule.retry(now, failed(1), kDear);
    EXPECT_EQ(order(5), "2 3 r1 2 2") << "one for each of the stations that waited";
}

TEST_F(ScheduleTest, WhereTheWholeLineRestsARetryGoesFirst) {
    settings.quarantine = Quarantine::line;
    rebuild();
    wait(2);
    schedule.retry(now, failed(1), kDear);
    EXPECT_EQ(order(), "r1 2");
}

TEST_F(ScheduleTest, NothingElseGoesToAStationBeforeItsRetry) {
    wait(1, true);
    wait(1);
    schedule.retry(now, failed(1), kCheap);
    EXPECT_EQ(order(), "r1 1 1");
}

TEST_F(ScheduleTest, P1AStationWithAnOutstandingReplyIsPassedOver) {
    wait(1);
    wait(2);
    stations.of(1).add_outstanding(now, read_of(9999), now - 500ms);
    EXPECT_EQ(order(), "2");
    EXPECT_EQ(schedule.next_start(stations, quiet), stations.of(1).rested());
    now = stations.of(1).rested();
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
    const auto probe = next().group;
    ASSERT_TRUE(probe);
    EXPECT_EQ(probe->station, 1);
    EXPECT_TRUE(probe->probe);
    EXPECT_TRUE(probe->jobs.empty()) << "nobody waits for it";
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
    const auto reading = next().group;
    ASSERT_TRUE(reading);
    EXPECT_EQ(reading->learns_for, write);
    EXPECT_TRUE(reading->jobs.empty());
    EXPECT_EQ(reading->request.function(), 3);
    echo.on_unclear();
    const auto writing = next().group;
    ASSERT_TRUE(writing);
    ASSERT_EQ(writing->jobs.size(), 1u) << "what did not tell is not asked for ever";
    EXPECT_EQ(writing->request.function(), 6);
    EXPECT_EQ(writing->jobs.front().ticket, write);
}

TEST_F(ScheduleTest, ABroadcastGoesAloneAndToNoStation) {
    wait(0, true);
    const auto group = next().group;
    ASSERT_TRUE(group);
    EXPECT_EQ(group->station, 0);
    EXPECT_EQ(group->jobs.size(), 1u);
}

TEST_F(ScheduleTest, P1OnALineThatMayStallOutstandingRepliesNeedAReopening) {
    settings.may_stall = true;
    rebuild();
    wait(1);
    stations.of(1).add_outstanding(now, read_of(9999), now - 500ms);
    now = stations.of(1).rested();
    EXPECT_TRUE(next().reopen);
    schedule.on_transport_opened(now);
    const auto proof = next();
    ASSERT_TRUE(proof.group) << "a connection proves nothing";
    EXPECT_TRUE(proof.group->probe);
    EXPECT_NE(proof.group->request.reply_length(), test::request_of(read_of(9999)).reply_length())
        << "no reply to one is one to the other";
    schedule.on_transport_proved(now);
    const auto proved = next();
    EXPECT_FALSE(proved.reopen) << "something that was sent later has been answered";
    ASSERT_TRUE(proved.group);
    EXPECT_FALSE(proved.group->probe);
}

TEST_F(ScheduleTest, P1TheWholeLineRestsWhereTheConfigurationSaysSo) {
    const Group group = failed(1);
    Station& station = stations.of(1);
    station.add_outstanding(now, group.request.pdu(), now - 500ms);
    EXPECT_FALSE(schedule.line_rests_until(now, group, now - 500ms, station))
        << "its replies have never been late";
    settings.quarantine = Quarantine::line;
    rebuild();
    EXPECT_EQ(schedule.line_rests_until(now, group, now - 500ms, station), station.rested());
    Group probe = group;
    probe.probe = true;
    EXPECT_FALSE(schedule.line_rests_until(now, probe, now - 500ms, station))
        << "a probe lets the others go on";
}

TEST_F(ScheduleTest, PartsOfAJoinedReadGoAgainExceptForClientsThatHaveLeft) {
    Group group = failed(1);
    group.jobs.push_back(job(1));
    group.jobs.push_back(job(1));
    group.request = test::request_of(Writer().u8(3).u16(0).u16(100).take());
    group.span = group.request.span();
    const Ticket left = group.jobs[1].ticket;
    group.jobs[1].gone = true;
    const auto gone = schedule.give_back(group);
    ASSERT_EQ(gone.size(), 1u);
    EXPECT_EQ(gone.front().ticket, left);
    EXPECT_EQ(order(), "1 1");
}

}  // namespace
}  // namespace panelgate::arbiter::schedule_test
