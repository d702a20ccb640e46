#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <vector>

#include "panelgate/points/station_polls.hpp"

namespace panelgate::points::poll_schedule_test {
namespace {

const TimePoint kStart{1000s};

PollSchedule make_schedule(const std::vector<Duration>& intervals, Duration first_within = 24h) {
    return {intervals, kStart, {.first_within = first_within}};
}

/// Takes what is due and is done with it at once.
std::optional<std::size_t> serve(PollSchedule& schedule, TimePoint now) {
    const auto entry = schedule.take_due(now);
    if (entry) schedule.on_done(*entry, now);
    return entry;
}

/// When each entry was started, since kStart.
using Begun = std::map<std::size_t, std::vector<Duration>>;

/// Runs in virtual time; entries run one after the other, `taking` each.
Begun run(PollSchedule& schedule, Duration until, Duration taking = 0ms) {
    Begun begun;
    TimePoint now = kStart;
    while (schedule.next_due() && *schedule.next_due() < kStart + until) {
        now = std::max(now, *schedule.next_due());
        if (const auto entry = schedule.take_due(now)) {
            begun[*entry].push_back(now - kStart);
            now += taking;
            schedule.on_done(*entry, now);
        }
    }
    return begun;
}

TEST(PollSchedule, SpreadsEntriesOfOneIntervalEvenlyOverItAndGivesSlowOnesTheirFirstTurnSoon) {
    PollSchedule schedule = make_schedule({1s, 1s, 1s, 1s});
    EXPECT_EQ(
        run(schedule, 2s),
        (Begun{
            {0, {0ms, 1000ms}}, {1, {250ms, 1250ms}}, {2, {500ms, 1500ms}}, {3, {750ms, 1750ms}}}));
    PollSchedule slow = make_schedule({60s, 60s, 60s, 60s}, 4s);
    EXPECT_EQ(
        run(slow, 120s),
        (Begun{{0, {0s, 60s}}, {1, {1s, 15s, 75s}}, {2, {2s, 30s, 90s}}, {3, {3s, 45s, 105s}}}));
}

TEST(PollSchedule, SlowEntriesOfSeveralIntervalsGetTheirFirstTurnSoonToo) {
    PollSchedule schedule = make_schedule({600s, 20s, 60s, 40s}, 1s);
    EXPECT_EQ(run(schedule, 5s), (Begun{{1, {0ms}}, {3, {250ms}}, {2, {500ms}}, {0, {750ms}}}));
    EXPECT_EQ(run(schedule, 6s), (Begun{{3, {5s}}})) << "then each keeps its phase";
}

TEST(PollSchedule, KeepsIntervalsThatDivideEachOtherApart) {
    PollSchedule schedule = make_schedule({1s, 2s, 4s, 8s});
    while (*schedule.next_due() < kStart + 100s) {
        const TimePoint now = *schedule.next_due();
        ASSERT_TRUE(serve(schedule, now));
        EXPECT_GT(*schedule.next_due(), now) << "two at once";
    }
}

TEST(PollSchedule, ATurnOutOfTurnMovesNoOther) {
    PollSchedule schedule = make_schedule({10s, 10s});
    run(schedule, 10s);
    schedule.request_extra_turn(1, kStart + 11s);
    schedule.request_extra_turn(1, kStart + 11s);
    EXPECT_EQ(run(schedule, 30s), (Begun{{0, {10s, 20s}}, {1, {11s, 15s, 25s}}}));
    PollSchedule one = make_schedule({10s});
    ASSERT_TRUE(one.take_due(kStart));
    one.request_extra_turn(0, kStart + 1s);
    one.on_done(0, kStart + 2s);
    EXPECT_EQ(one.next_due(), kStart + 10s) << "while it is under way it is not hastened";
    one.request_extra_turn(0, kStart + 2s);
    EXPECT_EQ(one.next_due(), kStart + 2s);
}

TEST(PollSchedule, TurnsOutOfTurnComeInTheirOrderAndAreLimited) {
    const PollSchedule::Settings settings{.first_within = 1s, .extra_burst = 2, .extra_every = 1s};
    PollSchedule schedule(std::vector<Duration>(5, 1h), kStart, settings);
    run(schedule, 2s);
    for (const std::size_t entry : {4u, 0u, 3u, 1u})
        schedule.request_extra_turn(entry, kStart + 10s);
    EXPECT_EQ(run(schedule, 1min, 1ms),
              (Begun{{4, {10s}}, {0, {10s + 1ms}}, {3, {11s}}, {1, {12s}}}));
    schedule.request_extra_turn(4, kStart + 2h);
    schedule.request_extra_turn(3, kStart + 2h);
    EXPECT_TRUE(serve(schedule, kStart + 2h)) << "the burst is there again";
}

TEST(PollSchedule, DoesNotDriftOverTenThousandPeriods) {
    PollSchedule schedule = make_schedule({1s, 1s});
    std::minstd_rand random(7);
    std::size_t polls = 0;
    while (*schedule.next_due() < kStart + 10'000s) {
        const TimePoint due = *schedule.next_due();
        const TimePoint now = due + (random() % 300) * 1ms;  // the caller is late
        const auto entry = schedule.take_due(now);
        ASSERT_TRUE(entry);
        ASSERT_EQ((due - kStart) % 1s, *entry * 500ms);
        schedule.on_done(*entry, now + (random() % 100) * 1ms);
        ++polls;
    }
    EXPECT_EQ(polls, 20'000u);
}

TEST(PollSchedule, AfterAStallEveryEntryIsDueOnceAndKeepsItsPhase) {
    PollSchedule schedule = make_schedule({1s, 1s});
    const TimePoint late = kStart + 60'200ms;
    EXPECT_EQ(serve(schedule, late), 0u);
    EXPECT_EQ(serve(schedule, late), 1u);
    EXPECT_FALSE(serve(schedule, late));
    EXPECT_EQ(*schedule.next_due(), kStart + 60'500ms);
    EXPECT_EQ(serve(schedule, kStart + 60'500ms), 1u);
    EXPECT_EQ(serve(schedule, kStart + 61s), 0u);
    PollSchedule three = make_schedule({1s, 1s, 1s});
    EXPECT_EQ(serve(three, kStart), 0u);
    for (const std::size_t next : {1u, 2u, 0u})
        EXPECT_EQ(serve(three, kStart + 1s), next) << "as they became due";
}

TEST(PollSchedule, StartsNothingWhileAnEntryIsUnderWay) {
    PollSchedule schedule = make_schedule({1s, 1s});
    EXPECT_EQ(schedule.take_due(kStart), 0u);
    EXPECT_FALSE(schedule.next_due());
    EXPECT_FALSE(schedule.take_due(kStart + 1500ms));
    schedule.on_done(0, kStart + 3200ms);
    EXPECT_EQ(serve(schedule, kStart + 3200ms), 1u);
    EXPECT_EQ(*schedule.next_due(), kStart + 3500ms);
    EXPECT_EQ(serve(schedule, kStart + 3500ms), 1u);
    EXPECT_EQ(*schedule.next_due(), kStart + 4s) << "turns due meanwhile are lost";
}

TEST(PollSchedule, SharesALineThatIsTooSlowFairly) {
    PollSchedule schedule = make_schedule({100ms, 100ms, 100ms, 1s});
    const Begun begun = run(schedule, 100s, 70ms);
    const auto fast = static_cast<double>(begun.at(0).size());
    EXPECT_GT(fast, 400);  // the line can do 14 a second of 31 wanted
    EXPECT_NEAR(static_cast<double>(begun.at(1).size()), fast, 20);
    EXPECT_NEAR(static_cast<double>(begun.at(2).size()), fast, 20);
    EXPECT_GE(begun.at(3).size(), 98u);
}

TEST(PollSchedule, CallsThatAreEarlyRepeatedOrStrangeAreHarmless) {
    PollSchedule schedule = make_schedule({1s, 1s});
    EXPECT_FALSE(schedule.take_due(kStart - 5s));
    schedule.on_done(0, kStart);
    schedule.on_done(9, kStart);
    EXPECT_EQ(*schedule.next_due(), kStart);
    EXPECT_EQ(serve(schedule, kStart), 0u);
    schedule.on_done(0, kStart);
    EXPECT_EQ(*schedule.next_due(), kStart + 500ms);
    PollSchedule none = make_schedule({});
    EXPECT_FALSE(none.next_due().has_value());
    EXPECT_FALSE(none.take_due(kStart));
    PollSchedule shortest = make_schedule({0s});
    EXPECT_EQ(serve(shortest, kStart), 0u);
    EXPECT_EQ(*shortest.next_due(), kStart + PollSchedule::kMinInterval);
}

}  // namespace
}  // namespace panelgate::points::poll_schedule_test
