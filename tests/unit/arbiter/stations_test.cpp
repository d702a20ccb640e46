// All stations of a line: budgets, probes, proofs.
#include "panelgate/arbiter/stations.hpp"

#include <gtest/gtest.h>

#include <cstdint>

#include "panelgate/arbiter/timing.hpp"
#include "support/attempts.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::stations_test {
namespace {

using test::group_of;

constexpr std::uint8_t kStranger = 200;
constexpr Duration kCost = 500ms;
const Bytes kRead = "03 00 6B 00 02"_hex;
const Bytes kReply = "03 04 02 2B 00 01"_hex;

Settings three_stations() {
    Settings settings;
    for (const std::uint8_t id : Bytes{1, 2, 3}) {
        StationSettings station;
        station.id = id;
        settings.stations.push_back(station);
    }
    return settings;
}

Job job_for(std::uint8_t id, const Bytes& pdu = kRead) { return group_of(id, pdu).jobs.front(); }

class StationsTest : public testing::Test {
  protected:
    void answer(std::uint8_t id) {
        now += 1s;
        const auto attempt = test::answered(now - 30ms, now, group_of(id, kRead), kReply);
        stations.on_reply(now, false);
        if (stations.of(id).on_reply(now, attempt, false, 25ms).back) stations.on_recovery();
    }
    /// A transaction of one attempt fails.
    void fail(std::uint8_t id, Duration cost = kCost) {
        now += cost;
        const Attempt attempt(group_of(id, kRead), test::timing_of(now - cost, 8), {}, {});
        if (stations.health(id).offline()) stations.on_probe(now - cost, id);
        stations.of(id).on_failed(now, attempt, Verdict::silent, cost, true);
        stations.on_failed(now, id, true, cost);
        stations.of(id).on_given_up(now, Fault::timeout, true);
    }
    void kill(std::uint8_t id, Duration cost = kCost) {
        while (!stations.health(id).offline()) fail(id, cost);
        fail(id, cost);  // the first probe
    }
    void leave_outstanding(std::uint8_t id, const Bytes& pdu) {
        stations.outstanding().add(id, {.sent = now, .until = now + 1s, .pdu = pdu});
    }
    Duration wait_for_probe() const { return *stations.next_probe(now) - now; }
    modbus::Request probe_for(std::uint8_t id) { return stations.probe_for(now, stations.of(id)); }

    Stations stations{three_stations()};
    TimePoint now{1h};
};

TEST_F(StationsTest, P4ProbesTakeLessThanFivePercentOfALineOnWhichOthersAnswer) {
    answer(1);
    kill(2);
    EXPECT_GE(wait_for_probe(), 20 * kCost - kCost);
}

TEST_F(StationsTest, P4WhereAllHaveJustFallenSilentProbesGoOn) {
    for (const std::uint8_t id : Bytes{1, 2, 3}) answer(id);
    for (const std::uint8_t id : Bytes{1, 2, 3}) kill(id, 300ms);
    EXPECT_LE(wait_for_probe(), 1s);
    now += timing::kYoungOutage;
    fail(1);
    EXPECT_GE(wait_for_probe(), 20 * kCost - kCost);
    stations.on_opened(now);
    EXPECT_LE(wait_for_probe(), 5s) << "the line was opened: all stations may be there";
}

TEST_F(StationsTest, P4SuspectsAndStrangersTogetherHaveOneBudgetWhichIsNotThatOfProbes) {
    answer(1);
    kill(2, 20ms);
    now += 1min;
    ASSERT_LE(wait_for_probe(), 0s);
    for (int i = 0; i < 2; ++i) fail(kStranger);
    EXPECT_TRUE(stations.may_spend(now, job_for(kStranger))) << "two whole timeouts in advance";
    fail(kStranger + 1);
    EXPECT_FALSE(stations.may_spend(now, job_for(kStranger)));
    EXPECT_TRUE(stations.may_spend(now, job_for(1))) << "nothing shows that it would fail";
    fail(1);
    EXPECT_FALSE(stations.may_spend(now, job_for(1)));
    EXPECT_LE(wait_for_probe(), 0s);
}

TEST_F(StationsTest, P4ASuspectWaitsForItsShareOnlyWhileOthersUseTheLine) {
    for (int i = 0; i < 2; ++i) fail(1, 1s);
    EXPECT_LE(stations.held_until(now, job_for(1)), now) << "nobody else is there";
    answer(2);
    EXPECT_GT(stations.held_until(now, job_for(1)), now);
    EXPECT_LE(stations.held_until(now, job_for(2)), now);
    now += timing::kOthersActive;
    EXPECT_LE(stations.held_until(now, job_for(1)), now);
}

TEST_F(StationsTest, T1SingleFailuresAreNoOutageBeforeOneStationHasFailedTwice) {
    for (std::uint8_t id = 1; id < 5; ++id) fail(id, 1s);
    answer(5);
    EXPECT_LE(stations.held_until(now, job_for(1)), now);
    fail(2, 1s);
    answer(5);
    EXPECT_GT(stations.held_until(now, job_for(1)), now);
}

TEST_F(StationsTest, P4AnyRequestMayWakeAStrangerAndAScanAsksEachTime) {
    Job read = job_for(kStranger);
    EXPECT_FALSE(stations.refuses(now, read));
    kill(kStranger);
    EXPECT_TRUE(stations.refuses(now, read));
    now += 30s;
    EXPECT_FALSE(stations.refuses(now, read));
    EXPECT_TRUE(stations.refuses(now, read));
    read.search = true;
    EXPECT_FALSE(stations.refuses(now, read));
    EXPECT_FALSE(stations.next_to_probe(now)) << "nobody probes an address that may not exist";
}

TEST_F(StationsTest, T2AProofIsAReadOfAnotherLengthThanWhatIsOutstanding) {
    answer(1);
    EXPECT_EQ(probe_for(1).pdu(), kRead) << "the shortest read that was answered";
    leave_outstanding(1, kRead);
    EXPECT_EQ(probe_for(1).pdu(), "03 00 6B 00 01"_hex) << "a part of it";
    leave_outstanding(1, "03 00 6B 00 01"_hex);
    EXPECT_EQ(probe_for(1).pdu(), "03 00 6B 00 03"_hex) << "longer by one item";
    leave_outstanding(1, "03 00 6B 00 03"_hex);
    EXPECT_FALSE(stations.proof_for(now, stations.of(1)));
    EXPECT_EQ(probe_for(1).pdu(), kRead) << "at most answered by its own earlier attempt";
}

}  // namespace
}  // namespace panelgate::arbiter::stations_test
