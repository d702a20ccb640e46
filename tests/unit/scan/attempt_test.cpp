#include "attempt.hpp"

#include <gtest/gtest.h>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::scan::attempt_test {
namespace {

const SerialFormat k9600{9600, 8, Parity::none, 1};
const TimePoint kSent{1h};
const Bytes kQuestion = "03 00 00 00 01"_hex;
const Bytes kReply = modbus::encode_adu(7, "03 02 00 05"_hex);

Attempt make(const SerialFormat& format = k9600) {
    return {*ReadRequest::make(7, kQuestion), format, kSent, {100ms, 60ms}};
}
Bytes joined(std::initializer_list<Bytes> parts) {
    Bytes all;
    for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}
Outcome hearing(const Bytes& bytes) {
    Attempt attempt = make();
    attempt.on_rx(kSent + 20ms, bytes);
    return attempt.finish();
}

TEST(Attempt, WaitsFromTheEndOfTheRequest) {
    EXPECT_EQ(make().ends_at(), kSent + wire_time(k9600, 8) + 100ms);
    EXPECT_EQ(make().finish().kind, Outcome::Kind::silent);
}

TEST(Attempt, EndsWhenNothingFollowsTheReply) {
    Attempt attempt = make();
    attempt.on_rx(kSent + 20ms, kReply);
    EXPECT_EQ(attempt.ends_at(), kSent + 80ms);
    EXPECT_EQ(attempt.finish().kind, Outcome::Kind::replied);
    EXPECT_EQ(attempt.finish().reply, "03 02 00 05"_hex);
}

TEST(Attempt, WaitsForTheRestOfWhatHasBegunButNotForBabble) {
    Attempt attempt = make();
    attempt.on_rx(kSent + 107ms, Bytes(kReply.begin(), kReply.begin() + 3));
    EXPECT_EQ(attempt.ends_at(), kSent + 167ms);
    for (int i = 0; i < 10'000; ++i) attempt.on_rx(kSent + 107ms + i * 1ms, "55 AA 55 AA"_hex);
    EXPECT_LT(attempt.ends_at(), kSent + 1s);
    EXPECT_EQ(attempt.finish().kind, Outcome::Kind::damaged);
}

TEST(Attempt, CountsFurtherRepliesAndTornOnes) {
    EXPECT_EQ(hearing(joined({kReply, kReply})).more, 1u);
    EXPECT_FALSE(hearing(joined({kReply, kReply})).with_damage);
    EXPECT_TRUE(hearing(joined({kReply, "07 03 02 00"_hex})).with_damage);
    EXPECT_FALSE(hearing(joined({"00"_hex, kReply, "FF"_hex})).with_damage)
        << "a transceiver switches";
}

TEST(Attempt, TellsADamagedReplyFromNoise) {
    Bytes damaged = kReply;
    damaged[4] ^= 1;
    EXPECT_EQ(hearing(damaged).kind, Outcome::Kind::damaged);
    EXPECT_TRUE(hearing(damaged).header_seen);
    EXPECT_EQ(hearing("11 22 33 44 55"_hex).kind, Outcome::Kind::damaged);
    EXPECT_FALSE(hearing("11 22 33 44 55"_hex).header_seen);
    EXPECT_EQ(hearing("00 FF"_hex).kind, Outcome::Kind::silent);
}

TEST(Attempt, TakesTheEchoOutWholeOrInPart) {
    const Bytes request = make().request().adu();
    EXPECT_EQ(hearing(joined({request, kReply})).kind, Outcome::Kind::replied);
    EXPECT_FALSE(hearing(joined({request, kReply})).with_damage);
    EXPECT_EQ(hearing(request).kind, Outcome::Kind::silent);
    EXPECT_EQ(hearing(Bytes(request.begin(), request.begin() + 5)).kind, Outcome::Kind::silent);
    Attempt attempt = make();
    attempt.on_rx(kSent + 5ms, request);
    EXPECT_EQ(attempt.ends_at(), make().ends_at()) << "an echo is not the beginning of a reply";
}

TEST(Attempt, GivesFramesOfOthersAndOfOtherRequests) {
    const Bytes other = modbus::encode_adu(8, "03 02 00 05"_hex);
    const Bytes longer = modbus::encode_adu(7, "03 04 00 05 00 06"_hex);
    const Outcome outcome = hearing(joined({other, longer, kReply}));
    EXPECT_EQ(outcome.kind, Outcome::Kind::replied);
    ASSERT_EQ(outcome.unsolicited.size(), 2u);
    EXPECT_EQ(outcome.unsolicited[0].station, 8);
    EXPECT_EQ(outcome.unsolicited[1].pdu.size(), 6u);
}

}  // namespace
}  // namespace panelgate::scan::attempt_test
