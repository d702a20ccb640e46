// What the replies of a panel that wrongly answers broadcasts may be taken for (P8).

#include "panelgate/arbiter/outstanding.hpp"

#include <gmock/gmock.h>

#include "arbiter_fixture.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::broadcast_replies_test {
namespace {

const Bytes kToAll = "10 00 64 00 02 04 00 0A 01 02"_hex;
const Bytes kToOne = "10 00 64 00 02 04 00 0B 00 00"_hex;
const Bytes kElsewhere = "10 00 68 00 02 04 00 0B 00 00"_hex;
const Bytes kConfirmed = "10 00 64 00 02"_hex;

class ArbiterBehindABroadcast : public ArbiterTest {
  protected:
    /// Station 17 has needed so long for its answers.
    void teach(Duration think) {
        bus.submit(17, kRead);
        bus.run_to_end_of_request();
        bus.run_for(think);
        bus.hear_reply(17, kReply);
        bus.run_for(1s);
    }
    /// When its last bit has left.
    TimePoint broadcast(const Bytes& pdu = kToAll) {
        bus.submit(0, pdu, 1, PriorityClass::write);
        bus.run_to_end_of_request();
        return bus.now();
    }
    std::optional<TimePoint> sent(const Bytes& pdu, TimePoint until) {
        bus.run_until(until);
        for (const auto& one : bus.sent) {
            if (one.adu == modbus::encode_adu(17, pdu)) return one.at;
        }
        return std::nullopt;
    }
};

TEST_F(ArbiterBehindABroadcast, P8ALateReplyToItConfirmsNoWrite) {
    teach(150ms);
    const TimePoint left = broadcast();
    const Ticket write = bus.submit(17, kToOne, 2, PriorityClass::write);
    bus.run_until(left + 150ms);
    bus.hear_reply(17, kConfirmed);
    EXPECT_FALSE(bus.answered(write));
    EXPECT_TRUE(sent(kToOne, left + 1500ms));
}

TEST_F(ArbiterBehindABroadcast, SuchAWriteGoesWhenItsStationHasHadAllTheTimeThatItEverNeeded) {
    teach(150ms);
    const TimePoint left = broadcast();
    bus.submit(17, kToOne, 2, PriorityClass::write);
    const auto at = sent(kToOne, left + 1s);
    ASSERT_TRUE(at);
    EXPECT_GT(*at, left + 150ms);
    EXPECT_LT(*at, left + 300ms);
}

TEST_F(ArbiterBehindABroadcast, AQuickPanelsGoesAtTheTurnaround) {
    teach(20ms);
    const TimePoint left = broadcast();
    bus.submit(17, kToOne, 2, PriorityClass::write);
    EXPECT_EQ(sent(kToOne, left + 1s), left + settings.broadcast_turnaround);
}

TEST_F(ArbiterBehindABroadcast, WhatIsConfirmedInOtherWordsGoesAtTheTurnaround) {
    teach(150ms);
    const TimePoint left = broadcast();
    bus.submit(17, kElsewhere, 2, PriorityClass::write);
    EXPECT_EQ(sent(kElsewhere, left + 1s), left + settings.broadcast_turnaround);
}

TEST_F(ArbiterBehindABroadcast, AnotherBroadcastGoesAtTheTurnaround) {
    const TimePoint left = broadcast();
    bus.submit(0, kToOne, 2, PriorityClass::write);
    bus.run_until(left + 200ms);
    EXPECT_EQ(bus.sent.back().at, left + settings.broadcast_turnaround);
}

TEST_F(ArbiterBehindABroadcast, OthersGoMeanwhile) {
    teach(150ms);
    const TimePoint left = broadcast();
    bus.submit(17, kToOne, 2, PriorityClass::write);
    bus.submit(17, read_at(7), 3);
    EXPECT_EQ(sent(read_at(7), left + 110ms), left + settings.broadcast_turnaround);
}

TEST_F(ArbiterBehindABroadcast, AStationNeverHeardHasItsResponseTimeout) {
    const TimePoint left = broadcast();
    bus.submit(17, kToOne, 2, PriorityClass::write);
    EXPECT_EQ(sent(kToOne, left + 1s), left + settings.unlisted.response_timeout);
}

TEST_F(ArbiterBehindABroadcast, AStationThatHasAnsweredOneIsWaitedForAsForAnyOutstandingReply) {
    teach(20ms);
    broadcast();
    bus.run_for(20ms);
    bus.hear_reply(17, kConfirmed);
    bus.run_for(1s);
    const TimePoint left = broadcast();
    bus.submit(17, kToOne, 2, PriorityClass::write);
    EXPECT_EQ(sent(kToOne, left + 1900ms), left + 2 * settings.unlisted.response_timeout);
}

TEST_F(ArbiterBehindABroadcast, ALineThatIsLostUnderItChangesNothing) {
    teach(150ms);
    bus.submit(0, kToAll, 1, PriorityClass::write);
    const TimePoint left = bus.now() + wire_time(settings.serial, kToAll.size() + 3);
    bus.run_until(left - 100us);
    bus.line_down();
    bus.line_up();
    bus.submit(17, kToOne, 2, PriorityClass::write);
    const auto at = sent(kToOne, left + 1s);
    ASSERT_TRUE(at);
    EXPECT_GT(*at, left + 150ms);
}

TEST(BroadcastReplies, AreRememberedOfTheLastOnesAndConcernNoReads) {
    BroadcastReplies replies;
    const TimePoint start{1h};
    const auto to_one = test::request_of(kToOne);
    EXPECT_EQ(replies.over(to_one, 1s), TimePoint{});
    replies.on_sent(start, kToAll);
    EXPECT_EQ(replies.over(to_one, 1s), start + 1s);
    EXPECT_EQ(replies.over(test::request_of(kRead), 1s), TimePoint{});
    for (std::size_t i = 0; i + 1 < BroadcastReplies::kBroadcasts; ++i)
        replies.on_sent(start + 1s, kElsewhere);
    EXPECT_EQ(replies.over(to_one, 1s), start + 1s);
    replies.on_sent(start + 1s, kElsewhere);
    EXPECT_EQ(replies.over(to_one, 1s), TimePoint{});
}

}  // namespace
}  // namespace panelgate::arbiter::broadcast_replies_test
