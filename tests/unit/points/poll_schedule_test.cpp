#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "panelgate/points/station_polls.hpp"

namespace panelgate::points::poll_schedule_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

const TimePoint kStart{1000s};

PollSchedule make_schedule(const std::vector<Duration>& intervals, std::size_t outstanding = 1000,
                           Duration first_within = 24h) {
    return {intervals, kStart, {.max_outstanding = outstanding, .first_within = first_within}};
}

/// When each entry was started, since kStart.
using Begun = std::map<std::size_t, std::vector<Duration>>;

/// Runs in virtual time; entries run one after the other, `taking` each.
Begun run(PollSchedule& schedule, Duration until, Duration taking = 0ms) {
    Begun begun;
    TimePoint now = kStart;
    while (schedule.next_due() && *schedule.next_due() < kStart + until) {
        now = std::max(now, *schedule.next_due());
        for (const std::size_t entry : schedule.take_due(now)) {
            begun[entry].push_back(now - kStart);
            now += taking;
            schedule.on_done(entry, now);
        }
    }
    return begun;
}

std::uint64_t lost(const PollSchedule& schedule) {
    return schedule.counters().missed + schedule.counters().skipped;
}

TEST(PollSchedule, SpreadsEntriesOfOneIntervalEvenlyOverItAndGivesSlowOnesTheirFirstTurnSoon) {
    PollSchedule schedule = make_schedule({1s, 1s, 1s, 1s});
    EXPECT_EQ(
        run(schedule, 2s),
        (Begun{
            {0, {0ms, 1000ms}}, {1, {250ms, 1250ms}}, {2, {500ms, 1500ms}}, {3, {750ms, 1750ms}}}));
    PollSchedule slow = make_schedule({60s, 60s, 60s, 60s}, 1000, 4s);
    EXPECT_EQ(
        run(slow, 120s),
        (Begun{{0, {0s, 60s}}, {1, {1s, 15s, 75s}}, {2, {2s, 30s, 90s}}, {3, {3s, 45s, 105s}}}));
    EXPECT_EQ(lost(slow), 0u);
}

TEST(PollSchedule, SlowEntriesOfSeveralIntervalsGetTheirFirstTurnSoonToo) {
    PollSchedule schedule = make_schedule({600s, 20s, 60s, 40s}, 1000, 1s);
    EXPECT_EQ(run(schedule, 5s), (Begun{{1, {0ms}}, {3, {250ms}}, {2, {500ms}}, {0, {750ms}}}));
    EXPECT_EQ(run(schedule, 6s), (Begun{{3, {5s}}})) << "then each keeps its phase";
}

TEST(PollSchedule, KeepsIntervalsThatDivideEachOtherApart) {
    PollSchedule schedule = make_schedule({1s, 2s, 4s, 8s});
    while (*schedule.next_due() < kStart + 100s) {
        const TimePoint now = *schedule.next_due();
        const auto due = schedule.take_due(now);
        ASSERT_THAT(due, SizeIs(1));
        schedule.on_done(due[0], now);
    }
    EXPECT_EQ(lost(schedule), 0u);
}

TEST(PollSchedule, ATurnOutOfTurnMovesNoOther) {
    PollSchedule schedule = make_schedule({10s, 10s});
    run(schedule, 10s);
    schedule.request_extra_turn(1, kStart + 11s);
    schedule.request_extra_turn(1, kStart + 11s);
    EXPECT_EQ(run(schedule, 30s), (Begun{{0, {10s, 20s}}, {1, {11s, 15s, 25s}}}));
    EXPECT_EQ(lost(schedule), 0u);
    PollSchedule one = make_schedule({10s});
    ASSERT_THAT(one.take_due(kStart), SizeIs(1));
    one.request_extra_turn(0, kStart + 1s);
    one.on_done(0, kStart + 2s);
    EXPECT_EQ(one.next_due(), kStart + 10s) << "while it is under way it is not hastened";
    one.request_extra_turn(0, kStart + 2s);
    EXPECT_EQ(one.next_due(), kStart + 2s);
}

TEST(PollSchedule, TurnsOutOfTurnComeInTheirOrderAndAreLimited) {
    const PollSchedule::Settings settings{
        .max_outstanding = 1, .first_within = 1s, .extra_burst = 2, .extra_every = 1s};
    PollSchedule schedule(std::vector<Duration>(5, 1h), kStart, settings);
    run(schedule, 2s);
    for (const std::size_t entry : {4u, 0u, 3u, 1u})
        schedule.request_extra_turn(entry, kStart + 10s);
    EXPECT_EQ(run(schedule, 1min, 1ms),
              (Begun{{4, {10s}}, {0, {10s + 1ms}}, {3, {11s}}, {1, {12s}}}));
    schedule.request_extra_turn(4, kStart + 2h);
    schedule.request_extra_turn(3, kStart + 2h);
    EXPECT_EQ(schedule.take_due(kStart + 2h).size(), 1u) << "the burst is there again";
}

TEST(PollSchedule, DoesNotDriftOverTenThousandPeriods) {
    PollSchedule schedule = make_schedule({1s, 1s});
    std::minstd_rand random(7);
    std::size_t polls = 0;
    while (*schedule.next_due() < kStart + 10'000s) {
        const TimePoint due = *schedule.next_due();
        const TimePoint now = due + (random() % 300) * 1ms;  // the caller is late
        for (const std::size_t entry : schedule.take_due(now)) {
            ASSERT_EQ((due - kStart) % 1s, entry * 500ms);
            schedule.on_done(entry, now + (random() % 100) * 1ms);
            ++polls;
        }
    }
    EXPECT_EQ(polls, 20'000u);
    EXPECT_EQ(lost(schedule), 0u);
}

TEST(PollSchedule, AfterAStallEveryEntryIsDueOnceAndKeepsItsPhase) {
    PollSchedule schedule = make_schedule({1s, 1s});
    const TimePoint late = kStart + 60'200ms;
    EXPECT_THAT(schedule.take_due(late), ElementsAre(0, 1));
    EXPECT_EQ(schedule.counters().missed, 60u + 59u);
    EXPECT_THAT(schedule.take_due(late), IsEmpty());
    schedule.on_done(0, late);
    schedule.on_done(1, late);
    EXPECT_THAT(schedule.take_due(late), IsEmpty());
    EXPECT_EQ(*schedule.next_due(), kStart + 60'500ms);
    EXPECT_THAT(schedule.take_due(kStart + 60'500ms), ElementsAre(1));
    EXPECT_THAT(schedule.take_due(kStart + 61s), ElementsAre(0));
    PollSchedule three = make_schedule({1s, 1s, 1s});
    three.take_due(kStart);
    three.on_done(0, kStart);
    EXPECT_THAT(three.take_due(kStart + 1s), ElementsAre(1, 2, 0)) << "as they became due";
}

TEST(PollSchedule, DoesNotStartAnEntryThatIsStillUnderWay) {
    PollSchedule schedule = make_schedule({1s});
    EXPECT_THAT(schedule.take_due(kStart), ElementsAre(0));
    EXPECT_THAT(schedule.take_due(kStart + 1s), IsEmpty());
    EXPECT_THAT(schedule.take_due(kStart + 1500ms), IsEmpty());
    EXPECT_EQ(schedule.counters().skipped, 1u);
    EXPECT_EQ(*schedule.next_due(), kStart + 2s);
    schedule.on_done(0, kStart + 3500ms);
    EXPECT_EQ(schedule.counters().skipped, 3u);
    EXPECT_EQ(*schedule.next_due(), kStart + 4s);
    EXPECT_THAT(schedule.take_due(kStart + 4s), ElementsAre(0));
    EXPECT_EQ(schedule.counters().missed, 0u);
}

TEST(PollSchedule, HoldsBackWhatExceedsTheLimitUntilSomethingIsDone) {
    PollSchedule schedule = make_schedule({1s, 1s, 1s}, 2);
    const TimePoint late = kStart + 900ms;
    EXPECT_THAT(schedule.take_due(late), ElementsAre(0, 1));
    EXPECT_EQ(schedule.outstanding(), 2u);
    EXPECT_FALSE(schedule.next_due().has_value());
    EXPECT_THAT(schedule.take_due(late), IsEmpty());
    schedule.on_done(0, late);
    ASSERT_TRUE(schedule.next_due().has_value());
    EXPECT_LE(*schedule.next_due(), late);
    EXPECT_THAT(schedule.take_due(late), ElementsAre(2));
}

TEST(PollSchedule, SharesALineThatIsTooSlowFairly) {
    PollSchedule schedule = make_schedule({100ms, 100ms, 100ms, 1s}, 1);
    const Begun begun = run(schedule, 100s, 70ms);
    const auto fast = static_cast<double>(begun.at(0).size());
    EXPECT_GT(fast, 400);  // the line can do 14 a second of 31 wanted
    EXPECT_NEAR(static_cast<double>(begun.at(1).size()), fast, 20);
    EXPECT_NEAR(static_cast<double>(begun.at(2).size()), fast, 20);
    EXPECT_GE(begun.at(3).size(), 98u);
    EXPECT_GT(lost(schedule), 1000u);
}

TEST(PollSchedule, CallsThatAreEarlyRepeatedOrStrangeAreHarmless) {
    PollSchedule schedule = make_schedule({1s, 1s});
    EXPECT_THAT(schedule.take_due(kStart - 5s), IsEmpty());
    schedule.on_done(0, kStart);
    schedule.on_done(9, kStart);
    EXPECT_EQ(schedule.outstanding(), 0u);
    EXPECT_EQ(*schedule.next_due(), kStart);
    EXPECT_THAT(schedule.take_due(kStart), ElementsAre(0));
    schedule.on_done(0, kStart);
    schedule.on_done(0, kStart);
    EXPECT_EQ(schedule.outstanding(), 0u);
    PollSchedule none = make_schedule({});
    EXPECT_FALSE(none.next_due().has_value());
    EXPECT_THAT(none.take_due(kStart), IsEmpty());
    PollSchedule shortest = make_schedule({0s}, 0);
    EXPECT_THAT(shortest.take_due(kStart), ElementsAre(0));
    shortest.on_done(0, kStart);
    EXPECT_EQ(*shortest.next_due(), kStart + PollSchedule::kMinInterval);
}

}  // namespace
}  // namespace panelgate::points::poll_schedule_test
