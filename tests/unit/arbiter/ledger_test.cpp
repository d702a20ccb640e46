#include "panelgate/arbiter/outbox.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "support/attempts.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::ledger_test {
namespace {

const Bytes kRead = "03 00 6B 00 01"_hex;
const Bytes kReply = "03 02 02 2B"_hex;

Settings one_station() {
    Settings settings;
    settings.stations = {settings.unlisted};
    settings.stations[0].id = 17;
    return settings;
}

class OutboxTest : public testing::Test {
  protected:
    Attempt answered(Group group) const {
        return test::answered(now - 30ms, now, std::move(group), kReply);
    }
    static constexpr std::string_view kKinds = "TFNDSWRE";
    /// Its actions: T transmit, F finish, N note, D decision, S station event, W written, R reset,
    /// E exchange.
    std::string said() {
        std::string words;
        while (const auto action = outbox.poll()) words += kKinds[action->index()];
        return words;
    }
    static modbus::Unused frame_of(std::uint8_t station) {
        return {modbus::Unused::Kind::foreign, station, Bytes(6)};
    }
    const StationCounters& of(std::uint8_t station) const { return outbox.stations().at(station); }

    Settings settings = one_station();
    Outbox outbox{settings};
    TimePoint now{1h};
};

TEST_F(OutboxTest, ReportsEverythingOnceInTheOrderInWhichItHappened) {
    const Group group = test::group_of(17, kRead);
    outbox.transmit(now, answered(group), kRead, kRead, {});
    outbox.event(StationEvent::Kind::online, 17);
    outbox.finish(group.jobs.front(), kReply);
    outbox.reset("stalled");
    EXPECT_EQ(said(), "NTSFR");
    EXPECT_EQ(said(), "");
}

TEST_F(OutboxTest, AnAnswerSaysWhetherItsRequestWasEverSent) {
    Job job{.ticket = 5, .request = test::request_of(kRead)};
    outbox.finish(job, Fault::timeout);
    job.attempts = 1;
    outbox.finish(job, kReply, true);
    outbox.finish_from_memory(6, kReply, 3s);
    const auto never = std::get<Finish>(*outbox.poll());
    EXPECT_EQ(never.ticket, 5u);
    EXPECT_FALSE(never.transmitted);
    const auto shared = std::get<Finish>(*outbox.poll());
    EXPECT_TRUE(shared.transmitted);
    EXPECT_TRUE(shared.shared);
    EXPECT_FALSE(shared.age);
    const auto remembered = std::get<Finish>(*outbox.poll());
    EXPECT_FALSE(remembered.transmitted);
    EXPECT_EQ(remembered.age, Duration(3s));
}

TEST_F(OutboxTest, ARepeatedRequestIsARetryOfItsStationAndABroadcastOfTheLine) {
    outbox.transmit(now, answered(test::group_of(17, kRead, 1)), kRead, kRead, {});
    EXPECT_EQ(of(17).retries, 0u);
    outbox.transmit(now, answered(test::group_of(17, kRead, 2)), kRead, kRead, {});
    EXPECT_EQ(of(17).retries, 1u);
    EXPECT_EQ(outbox.line().broadcasts, 0u);
}

TEST_F(OutboxTest, UnlistedStationsShareOneAccount) {
    outbox.on_unsolicited(now, frame_of(98), Outbox::Part::late, 17, 5ms);
    outbox.on_unsolicited(now, frame_of(99), Outbox::Part::late, 17, 5ms);
    EXPECT_EQ(of(0).late_frames, 2u);
    EXPECT_EQ(of(17).late_frames, 0u);
    EXPECT_EQ(outbox.stations().size(), 2u) << "no stranger can add one";
}

TEST_F(OutboxTest, AForeignFrameCountsForTheStationThatWasAsked) {
    outbox.on_unsolicited(now, frame_of(99), Outbox::Part::unknown, 17);
    EXPECT_EQ(of(17).foreign_frames, 1u);
    EXPECT_EQ(of(17).discarded_bytes, 6u);
    EXPECT_EQ(of(0).foreign_frames, 0u);
    EXPECT_EQ(said(), "N");
}

TEST_F(OutboxTest, DamageInsideAnAttemptIsCountedWithTheAttempt) {
    const modbus::Unused damaged{modbus::Unused::Kind::damaged, 0, Bytes(3)};
    outbox.inside_attempt(true);
    outbox.on_unsolicited(now, damaged, Outbox::Part::damaged, 17);
    EXPECT_EQ(of(17).symptoms.strays, 0u);
    outbox.inside_attempt(false);
    outbox.on_unsolicited(now, damaged, Outbox::Part::damaged, 17);
    EXPECT_EQ(of(17).symptoms.strays, 1u);
    EXPECT_EQ(of(17).discarded_bytes, 6u) << "its bytes are, in both";
}

TEST_F(OutboxTest, EachCollisionIsCountedAndReportedOnceIn10Seconds) {
    outbox.on_echo_mismatch(now, 17);
    EXPECT_EQ(said(), "S");
    outbox.on_echo_mismatch(now + 9s, 17);
    EXPECT_EQ(said(), "");
    outbox.on_echo_mismatch(now + 10s, 17);
    EXPECT_EQ(said(), "S");
    EXPECT_EQ(of(17).echo_mismatches, 3u);
}

TEST_F(OutboxTest, TheTimeOfATransactionIsFromItsFirstBitToTheGapBehindIt) {
    const Attempt attempt = answered(test::group_of(17, kRead));
    outbox.on_ended(now, attempt, 2ms);
    EXPECT_EQ(outbox.line().busy, now - attempt.timing().started + 2ms);
    EXPECT_EQ(outbox.shares().all().at(1).busy, outbox.line().busy);
}

TEST_F(OutboxTest, AClientThatHasLeftPaysForNothing) {
    Group group = test::group_of(17, kRead);
    group.jobs.push_back(group.jobs.front());
    group.jobs[1].client = 2;
    group.on_client_gone(2);
    outbox.on_ended(now, answered(group), 2ms);
    const auto& shares = outbox.shares().all();
    ASSERT_EQ(shares.size(), 1u);
    EXPECT_EQ(shares.at(1).busy, outbox.line().busy / 2) << "its half is nobody's";
    outbox.on_client_gone(1);
    EXPECT_TRUE(outbox.shares().all().empty());
}

TEST_F(OutboxTest, ReasonsAreOnlyPutIntoWordsWithExplain) {
    outbox.decide(now, [] {
        ADD_FAILURE() << "nobody wants it";
        return std::string();
    });
    EXPECT_EQ(said(), "");
    settings.explain = true;
    Outbox explaining(settings);
    explaining.decide(now, [] { return std::string("because"); });
    const auto decision = std::get<Decision>(*explaining.poll());
    EXPECT_EQ(decision.text, "because");
    EXPECT_EQ(decision.at, now);
}

}  // namespace
}  // namespace panelgate::arbiter::ledger_test
