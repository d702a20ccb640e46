// One station: its states, what is learned of the station, and when the station may be asked.
#include "panelgate/arbiter/station.hpp"

#include <gtest/gtest.h>

#include <cstdint>

#include "support/attempts.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::station_test {
namespace {

using test::group_of;

constexpr std::uint8_t kId = 17;
constexpr Duration kTimeout = 500ms;
const Bytes kRead = "03 00 6B 00 01"_hex;
const Bytes kWrite = "06 00 6B 00 01"_hex;
const Bytes kReply = "03 02 02 2B"_hex;

class StationTest : public testing::Test {
  protected:
    /// A request left 30 ms ago and is answered now; the first sign of the reply took 25 ms.
    Station::Replied answer(const Bytes& pdu = kRead, const Bytes& reply = kReply) {
        now += 1s;
        const Group group = group_of(kId, pdu);
        return station.on_reply(now, test::answered(now - 30ms, now, group, reply), false, 25ms);
    }
    void miss(Verdict verdict = Verdict::silent, const Bytes& pdu = kRead) {
        now += kTimeout;
        const Attempt attempt(group_of(kId, pdu), test::timing_of(now - kTimeout, 8), {}, {});
        station.on_failed(now, attempt, verdict, kTimeout, true);
    }
    /// A transaction of one attempt fails. Returns true if the failure took the station offline.
    bool fail(Verdict verdict = Verdict::silent, const Bytes& pdu = kRead) {
        miss(verdict, pdu);
        const Fault fault = verdict == Verdict::silent ? Fault::timeout : Fault::damaged;
        return station.on_given_up(now, fault, pdu == kRead);
    }
    void set(const StationSettings& settings) { station.apply(settings, {}, true); }
    Group retry_of(const Bytes& pdu, int attempts = 1) const {
        Group group = group_of(kId, pdu, attempts);
        group.was_online = true;
        return group;
    }

    Station station{kId, StationSettings{}, OfflineSettings{}, true, 40ms};
    TimePoint now{1h};
};

TEST_F(StationTest, AnAdaptiveTimeoutFollowsTheThinkTimeBetweenFloorAndWhatIsConfigured) {
    StationSettings settings = station.settings();
    settings.adaptive_timeout = true;
    set(settings);
    EXPECT_EQ(station.response_timeout(), kTimeout) << "nothing is known yet";
    for (int i = 0; i < 10; ++i) answer();
    const Duration wanted = settings.timeout_floor + 2 * 25ms;
    EXPECT_EQ(station.response_timeout(), wanted);
    miss();
    EXPECT_EQ(station.response_timeout(), 2 * wanted);
    for (int i = 0; i < 100; ++i) miss();
    EXPECT_EQ(station.response_timeout(), kTimeout);
    answer();
    EXPECT_EQ(station.response_timeout(), wanted);
}

TEST_F(StationTest, T1ReadsOfAStationThatIsOnlineAreRetriedAndWritesWhereTheStationSaysSo) {
    EXPECT_TRUE(station.may_retry(retry_of(kRead)));
    EXPECT_FALSE(station.may_retry(retry_of(kRead, 2))) << "as often as configured";
    EXPECT_FALSE(station.may_retry(retry_of(kWrite))) << "P2";
    Group other = retry_of(kRead);
    other.was_online = false;
    EXPECT_FALSE(station.may_retry(other));
    other = retry_of(kRead);
    other.on_client_gone(1);
    EXPECT_FALSE(station.may_retry(other)) << "nobody waits for the answer";
    StationSettings settings = station.settings();
    settings.retry_writes = true;
    set(settings);
    EXPECT_TRUE(station.may_retry(retry_of(kWrite)));
    other = retry_of(kWrite);
    other.repeatable = false;
    EXPECT_FALSE(station.may_retry(other)) << "not allowed when the write began";
}

TEST_F(StationTest, IsInTheWorstConditionThatIsTrueOfIt) {
    EXPECT_EQ(station.condition(), Condition::unheard);
    fail();
    EXPECT_EQ(station.condition(), Condition::missed) << "listed, and never heard";
    answer();
    EXPECT_EQ(station.condition(), Condition::well);
    fail(Verdict::damaged);
    fail(Verdict::damaged);
    EXPECT_EQ(station.condition(), Condition::failing);
    answer();
    EXPECT_EQ(station.condition(), Condition::well);
    for (const Condition next : {Condition::missed, Condition::failing, Condition::offline}) {
        fail();
        EXPECT_EQ(station.condition(), next);
    }
    EXPECT_TRUE(answer().back);
    EXPECT_EQ(station.condition(), Condition::well);
    for (int i = 0; i < 4; ++i) {
        fail();
        answer();
    }
    EXPECT_EQ(station.condition(), Condition::flaky);
}

}  // namespace
}  // namespace panelgate::arbiter::station_test
