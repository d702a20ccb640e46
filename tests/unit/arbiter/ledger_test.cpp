#include "panelgate/arbiter/ledger.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "support/attempts.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter {
namespace {

const Bytes kRead = "03 00 6B 00 01"_hex;
const Bytes kReply = "03 02 02 2B"_hex;

Settings one_station() {
    Settings settings;
    settings.stations = {settings.unlisted};
    settings.stations[0].id = 17;
    return settings;
}

class LedgerTest : public testing::Test {
  protected:
    Attempt answered(Group group) const {
        return test::answered(now - 30ms, now, std::move(group), kReply);
    }
    static constexpr std::string_view kKinds = "TFNDSWRE";
    /// What it says: T transmit, F finish, N note, D decision, S station event, W written, R reset,
    /// E exchange.
    std::string said() {
        std::string words;
        while (const auto action = ledger.poll()) words += kKinds[action->index()];
        return words;
    }
    static modbus::Unused frame_of(std::uint8_t station) {
        return {modbus::Unused::Kind::foreign, station, Bytes(6)};
    }
    const StationCounters& of(std::uint8_t station) const { return ledger.stations().at(station); }

    Settings settings = one_station();
    Ledger ledger{settings};
    TimePoint now{1h};
};

TEST_F(LedgerTest, SaysEverythingOnceInTheOrderInWhichItHappened) {
    const Group group = test::group_of(17, kRead);
    ledger.transmit(now, answered(group), kRead, kRead, {});
    ledger.event(StationEvent::Kind::online, 17);
    ledger.finish(group.jobs.front(), kReply);
    ledger.reset("stalled");
    EXPECT_EQ(said(), "NTSFR");
    EXPECT_EQ(said(), "");
}

TEST_F(LedgerTest, AnAnswerSaysWhetherItsRequestWasEverSent) {
    Job job{.ticket = 5, .request = test::request_of(kRead)};
    ledger.finish(job, Fault::timeout);
    job.attempts = 1;
    ledger.finish(job, kReply, true);
    ledger.finish_from_memory(6, kReply, 3s);
    const auto never = std::get<Finish>(*ledger.poll());
    EXPECT_EQ(never.ticket, 5u);
    EXPECT_FALSE(never.transmitted);
    const auto shared = std::get<Finish>(*ledger.poll());
    EXPECT_TRUE(shared.transmitted);
    EXPECT_TRUE(shared.shared);
    EXPECT_FALSE(shared.age);
    const auto remembered = std::get<Finish>(*ledger.poll());
    EXPECT_FALSE(remembered.transmitted);
    EXPECT_EQ(remembered.age, Duration(3s));
}

TEST_F(LedgerTest, ARepeatedRequestIsARetryOfItsStationAndABroadcastOfTheLine) {
    ledger.transmit(now, answered(test::group_of(17, kRead, 1)), kRead, kRead, {});
    EXPECT_EQ(of(17).retries, 0u);
    ledger.transmit(now, answered(test::group_of(17, kRead, 2)), kRead, kRead, {});
    EXPECT_EQ(of(17).retries, 1u);
    EXPECT_EQ(ledger.line().broadcasts, 0u);
}

TEST_F(LedgerTest, StationsThatNobodyListedShareOneAccount) {
    ledger.on_stray(now, frame_of(98), Ledger::Part::late, 17, 5ms);
    ledger.on_stray(now, frame_of(99), Ledger::Part::late, 17, 5ms);
    EXPECT_EQ(of(0).late_frames, 2u);
    EXPECT_EQ(of(17).late_frames, 0u);
    EXPECT_EQ(ledger.stations().size(), 2u) << "no stranger can add one";
}

TEST_F(LedgerTest, AForeignFrameIsWhatWhoWasAskedIsDisturbedBy) {
    ledger.on_stray(now, frame_of(99), Ledger::Part::unknown, 17);
    EXPECT_EQ(of(17).foreign_frames, 1u);
    EXPECT_EQ(of(17).discarded_bytes, 6u);
    EXPECT_EQ(of(0).foreign_frames, 0u);
    EXPECT_EQ(said(), "N");
}

TEST_F(LedgerTest, DamageInsideAnAttemptIsCountedWithTheAttempt) {
    const modbus::Unused damaged{modbus::Unused::Kind::damaged, 0, Bytes(3)};
    ledger.inside_attempt(true);
    ledger.on_stray(now, damaged, Ledger::Part::damaged, 17);
    EXPECT_EQ(of(17).symptoms.strays, 0u);
    ledger.inside_attempt(false);
    ledger.on_stray(now, damaged, Ledger::Part::damaged, 17);
    EXPECT_EQ(of(17).symptoms.strays, 1u);
    EXPECT_EQ(of(17).discarded_bytes, 6u) << "its bytes are, in both";
}

TEST_F(LedgerTest, CollisionsAreCountedEachAndToldOnceIn10Seconds) {
    ledger.on_echo_mismatch(now, 17);
    EXPECT_EQ(said(), "S");
    ledger.on_echo_mismatch(now + 9s, 17);
    EXPECT_EQ(said(), "");
    ledger.on_echo_mismatch(now + 10s, 17);
    EXPECT_EQ(said(), "S");
    EXPECT_EQ(of(17).echo_mismatches, 3u);
}

TEST_F(LedgerTest, TheTimeOfATransactionIsFromItsFirstBitToTheGapBehindIt) {
    const Attempt attempt = answered(test::group_of(17, kRead));
    ledger.on_ended(now, attempt, 2ms);
    EXPECT_EQ(ledger.line().busy, now - attempt.timing().started + 2ms);
    EXPECT_EQ(ledger.shares().all().at(1).busy, ledger.line().busy);
}

TEST_F(LedgerTest, WhoHasLeftPaysForNothing) {
    Group group = test::group_of(17, kRead);
    group.jobs.push_back(group.jobs.front());
    group.jobs[1].client = 2;
    group.on_gone(2);
    ledger.on_ended(now, answered(group), 2ms);
    const auto& shares = ledger.shares().all();
    ASSERT_EQ(shares.size(), 1u);
    EXPECT_EQ(shares.at(1).busy, ledger.line().busy / 2) << "its half is nobody's";
    ledger.on_client_gone(1);
    EXPECT_TRUE(ledger.shares().all().empty());
}

TEST_F(LedgerTest, ReasonsAreOnlyPutIntoWordsForWhoWantsThem) {
    ledger.decide(now, [] {
        ADD_FAILURE() << "nobody wants it";
        return std::string();
    });
    EXPECT_EQ(said(), "");
    settings.explain = true;
    Ledger explaining(settings);
    explaining.decide(now, [] { return std::string("because"); });
    const auto decision = std::get<Decision>(*explaining.poll());
    EXPECT_EQ(decision.text, "because");
    EXPECT_EQ(decision.at, now);
}

}  // namespace
}  // namespace panelgate::arbiter
