#include "panelgate/arbiter/stations.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "support/attempts.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::stations_test {
namespace {

const Bytes kRead = "03 00 6B 00 01"_hex;
const Bytes kReply = "03 02 02 2B"_hex;

constexpr std::array<std::uint8_t, 3> kIds{1, 2, 3};

Settings three_stations() {
    Settings settings;
    for (const std::uint8_t id : kIds) {
        StationSettings station;
        station.id = id;
        settings.stations.push_back(station);
    }
    return settings;
}

Job job_for(unsigned id) {
    return test::group_of(static_cast<std::uint8_t>(id), kRead).jobs.front();
}

class StationsTest : public testing::Test {
  protected:
    void answer(std::uint8_t id) {
        now_ += 1s;
        const auto attempt = test::answered(now_ - 30ms, now_, test::group_of(id, kRead), kReply);
        stations_.on_reply(now_, 30ms);
        if (stations_.of(id).on_reply(stations_.book(), now_, attempt, 30ms, 25ms).back)
            stations_.on_recovery();
    }
    /// It fails until it is offline; each attempt costs `cost`.
    void kill(std::uint8_t id, Duration cost) {
        for (int i = 0; i < 10; ++i) {
            now_ += cost;
            stations_.on_failed(now_, test::group_of(id, kRead), Verdict::silent, cost);
            stations_.of(id).on_given_up(now_, Fault::timeout);
        }
        ASSERT_TRUE(stations_.health(id).offline());
    }
    Duration wait_for_probe() const { return *stations_.next_probe() - now_; }

    Stations stations_{three_stations()};
    TimePoint now_{1h};
};

TEST_F(StationsTest, P4ProbesTakeThreePercentOfALineOnWhichOthersAnswer) {
    answer(1);
    kill(2, 500ms);
    EXPECT_GE(wait_for_probe(), 15s);
}

TEST_F(StationsTest, P4WhereAllHaveJustFallenSilentProbesGoOn) {
    for (const std::uint8_t id : kIds) answer(id);
    for (const std::uint8_t id : kIds) kill(id, 300ms);
    EXPECT_LE(wait_for_probe(), 1s);
}

TEST_F(StationsTest, P4WhereAllAreSilentForLongTheyTakeThreePercent) {
    for (const std::uint8_t id : kIds) answer(id);
    now_ += 1min;
    for (const std::uint8_t id : kIds) kill(id, 500ms);
    EXPECT_GE(wait_for_probe(), 15s);
}

TEST_F(StationsTest, P4WhenOneIsBackTheOthersAreAskedAtOnce) {
    for (const std::uint8_t id : kIds) answer(id);
    for (const std::uint8_t id : kIds) kill(id, 800ms);
    answer(2);
    now_ += OfflineSettings{}.probe_max;
    EXPECT_LE(wait_for_probe(), 0s);
}

TEST_F(StationsTest, P4AFlakyStationHasAShortWaitOnlyWhereAnotherHasAnsweredSince) {
    answer(1);
    answer(2);
    for (int i = 0; i < Station::kFlaky; ++i) {
        now_ += 500ms;
        stations_.on_failed(now_, test::group_of(1, kRead), Verdict::silent, 500ms);
    }
    const Station& flaky = stations_.of(1);
    ASSERT_TRUE(flaky.flaky());
    EXPECT_FALSE(stations_.flaky_beside_others(now_, flaky)) << "it may be the line";
    EXPECT_TRUE(stations_.affords_retry(now_, flaky));
    answer(2);
    EXPECT_TRUE(stations_.flaky_beside_others(now_, flaky));
    EXPECT_FALSE(stations_.affords_retry(now_, flaky));
    EXPECT_FALSE(stations_.flaky_beside_others(now_ + 1min, flaky)) << "nobody else is there";
}

TEST_F(StationsTest, P4OneThatHasUsedUpItsShareIsNotRetriedWhereOthersAnswer) {
    answer(1);
    const auto fail = [&] {
        now_ += 500ms;
        stations_.on_failed(now_, test::group_of(1, kRead), Verdict::damaged, 500ms);
        answer(2);
        return stations_.affords_retry(now_, stations_.of(1));
    };
    EXPECT_TRUE(fail()) << "two whole timeouts are free";
    for (int times = 0; times < 4; ++times) fail();
    EXPECT_FALSE(fail());
    now_ += timing::kOthersActive;
    EXPECT_TRUE(stations_.affords_retry(now_, stations_.of(1))) << "nobody else is there";
}

TEST_F(StationsTest, P4WhatOneLosesShortensTheWaitsBehindItAlsoOnceItHasAnswered) {
    for (int i = 0; i < 20; ++i) {
        answer(1);
        answer(2);
    }
    const auto wait = [&](std::uint8_t id) {
        return stations_.patience(now_, test::group_of(id, kRead));
    };
    const Duration whole = wait(1);
    stations_.on_failed(now_, test::group_of(2, kRead), Verdict::silent, 500ms);
    EXPECT_LT(wait(1), whole / 2) << "several may have failed together";
    answer(2);
    EXPECT_LT(wait(1), whole / 2) << "where every twentieth reply is lost, ten times fewer fail";
    now_ += 10s;
    EXPECT_EQ(wait(1), whole);
}

TEST_F(StationsTest, P4OfFewRepliesTheWaitBehindAnothersSilenceIsTheLonger) {
    for (int replies = 1; replies <= 16; ++replies) {
        answer(1);
        stations_.on_failed(now_, test::group_of(2, kRead), Verdict::silent, 500ms);
        const Duration wait = stations_.patience(now_, test::group_of(1, kRead));
        const Duration usual = stations_.of(1).usual();
        const Duration share = Duration(500ms) / (replies + 2);
        EXPECT_EQ(wait, replies < 16 ? std::max(usual, share) : usual) << replies;
    }
}

TEST_F(StationsTest, P4AShortSilenceDoesNotEndTheTimeInWhichOthersAreHurried) {
    for (int i = 0; i < 20; ++i) answer(1);
    stations_.on_failed(now_, test::group_of(2, kRead), Verdict::silent, 500ms);
    stations_.on_failed(now_, test::group_of(3, kRead), Verdict::silent, 30ms);
    now_ += 2s;
    EXPECT_EQ(stations_.patience(now_, test::group_of(1, kRead)), stations_.of(1).usual());
}

TEST_F(StationsTest, P1AProofIsAwaitedNoLongerThanItsStationHasEverNeeded) {
    answer(1);
    Group proof = test::group_of(1, kRead);
    EXPECT_EQ(stations_.patience(now_, proof), stations_.response_timeout(1));
    proof.distinct_length = true;
    EXPECT_EQ(stations_.patience(now_, proof), stations_.of(1).usual());
}

TEST_F(StationsTest, P4AWriteThatItIgnoresDoesNotKeepReadsFromShowingThatItIsBack) {
    answer(1);
    kill(1, 100ms);
    Station& station = stations_.of(1);
    now_ += 10s;
    EXPECT_TRUE(station.take_half_open(now_, false));
    now_ += 10s;
    EXPECT_FALSE(station.take_half_open(now_, false));
    station.on_asked(stations_.book(), now_, test::group_of(1, kRead));
    EXPECT_TRUE(station.take_half_open(now_, false));
}

TEST_F(StationsTest, AskingAgainForADoubtfulAnswerCountsAsNoRetry) {
    answer(1);
    Group group = test::group_of(1, kRead);
    group.attempts = 2;
    EXPECT_FALSE(stations_.of(1).may_retry(group));
    group.doubts = 1;
    EXPECT_TRUE(stations_.of(1).may_retry(group));
}

TEST_F(StationsTest, P4UnheardStationsDoNotUseUpTheProbeBudgetOfOthers) {
    constexpr std::uint8_t kStranger = 200;
    answer(1);
    kill(2, 20ms);
    now_ += 1min;
    ASSERT_LE(wait_for_probe(), 0s);
    for (int i = 0; i < 10; ++i)
        stations_.on_failed(now_, test::group_of(kStranger, kRead), Verdict::silent, 100ms);
    stations_.of(kStranger).on_given_up(now_, Fault::timeout);
    for (int i = 0; i < 10; ++i)
        stations_.on_failed(now_, test::group_of(kStranger, kRead), Verdict::silent, 100ms);
    EXPECT_LE(wait_for_probe(), 0s);
    EXPECT_FALSE(stations_.may_spend(now_, job_for(kStranger + 1)))
        << "all strangers have one budget";
    EXPECT_TRUE(stations_.may_spend(now_, job_for(3))) << "which is not that of who is listed";
}

TEST_F(StationsTest, AnUnheardStationIsWaitedForAsLongAsTheKnownNeedUnlessItsClientIsPatient) {
    constexpr std::uint8_t kStranger = 9;
    answer(1);
    Group group = test::group_of(kStranger, kRead);
    const Duration usual = stations_.patience(now_, group);
    EXPECT_LT(usual, 100ms);
    group.jobs[0].patience = 100ms;
    EXPECT_EQ(stations_.patience(now_, group), 100ms);
    group.jobs[0].patience = 1h;
    EXPECT_EQ(stations_.patience(now_, group), stations_.response_timeout(kStranger));
    group.jobs[0].patience = 1ms;
    EXPECT_EQ(stations_.patience(now_, group), usual);
}

}  // namespace
}  // namespace panelgate::arbiter::stations_test
