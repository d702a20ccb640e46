#include "panelgate/arbiter/outstanding.hpp"
#include "panelgate/arbiter/timing.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::outstanding_test {
namespace {

using modbus::encode_adu;
using test::request_of;

const Bytes kThree = "03 00 64 00 03"_hex;
const Bytes kReplyOfThree = "03 06 00 01 00 02 00 03"_hex;
const Bytes kTwo = "03 00 64 00 02"_hex;
const Bytes kReplyOfTwo = "03 04 00 01 00 02"_hex;
const Bytes kRefusal = "83 02"_hex;

TimePoint at(Duration since) { return TimePoint{} + since; }

class OutstandingTest : public testing::Test {
  protected:
    TimePoint oldest(const Bytes& reply) const { return outstanding.oldest(reply)->sent; }
    bool ambiguous(const Bytes& pdu, bool again = false) const {
        return outstanding.is_ambiguous(request_of(pdu), again);
    }
    OutstandingReplies outstanding;
};

TEST_F(OutstandingTest, TakesTheOldestThatAReplyMayAnswer) {
    outstanding.add(at(1s), kThree);
    outstanding.add(at(2s), kThree);
    outstanding.add(at(3s), kTwo);
    EXPECT_EQ(outstanding.take(kReplyOfTwo), kTwo);
    EXPECT_EQ(oldest(kReplyOfThree), at(1s));
    EXPECT_EQ(outstanding.take(kReplyOfThree), kThree);
    EXPECT_EQ(oldest(kReplyOfThree), at(2s));
    EXPECT_EQ(outstanding.take(kReplyOfTwo), Bytes{});
    EXPECT_EQ(outstanding.size(), 1u);
}

TEST_F(OutstandingTest, ARefusalMayBeOfAny) {
    outstanding.add(at(1s), kThree);
    outstanding.add(at(2s), kTwo);
    EXPECT_TRUE(outstanding.fits(kRefusal));
    EXPECT_EQ(outstanding.take(kRefusal), kThree);
}

TEST_F(OutstandingTest, PassesOverWhatCouldNotComeAnyMore) {
    outstanding.add(at(1s), kThree);
    outstanding.add(at(2s), kThree);
    EXPECT_EQ(outstanding.oldest(kReplyOfThree, at(1s))->sent, at(2s));
    EXPECT_EQ(outstanding.oldest(kReplyOfThree, at(5s))->sent, at(2s)) << "the last, if none could";
    EXPECT_EQ(outstanding.oldest(kReplyOfTwo, at(0s)), nullptr);
}

TEST_F(OutstandingTest, KnowsWhetherAReadsReplyWouldBeItsOwn) {
    outstanding.add(at(1s), kThree);
    EXPECT_TRUE(ambiguous("03 00 00 00 03"_hex)) << "of another place, but as long";
    EXPECT_FALSE(ambiguous(kTwo));
    EXPECT_FALSE(ambiguous("04 00 64 00 03"_hex));
    outstanding.add(at(2s), "01 00 00 00 08"_hex);
    EXPECT_TRUE(ambiguous("01 00 00 00 01"_hex)) << "a byte each";
    EXPECT_FALSE(ambiguous("01 00 00 00 09"_hex));
    EXPECT_TRUE(ambiguous(kThree)) << "asked anew, its value would be too old";
    EXPECT_FALSE(ambiguous(kThree, true)) << "repeated, it is an answer";
    outstanding.add(at(3s), "06 00 01 00 07"_hex);
    EXPECT_FALSE(ambiguous("06 00 01 00 08"_hex)) << "the reply names the value";
    EXPECT_TRUE(ambiguous("06 00 01 00 07"_hex));
    outstanding.add(at(4s), "10 00 01 00 01 02 00 07"_hex);
    EXPECT_TRUE(ambiguous("10 00 01 00 01 02 00 08"_hex)) << "and that of 10 only the count";
}

TEST_F(OutstandingTest, StationsServeInTurn) {
    outstanding.add(at(1s), kThree);
    outstanding.add(at(3s), kTwo);
    outstanding.add(at(5s), kThree);
    outstanding.close_before(at(5s), at(2s));
    EXPECT_EQ(outstanding.size(), 2u);
    EXPECT_EQ(oldest(kReplyOfThree), at(1s)) << "of another connection";
    EXPECT_FALSE(outstanding.fits(kReplyOfTwo));
    outstanding.close_before(at(9s), {});
    EXPECT_TRUE(outstanding.empty());
}

TEST_F(OutstandingTest, IsOnlyOfOneRequest) {
    EXPECT_FALSE(outstanding.is_only(kThree));
    outstanding.add(at(1s), kThree);
    EXPECT_TRUE(outstanding.is_only(kThree));
    outstanding.add(at(2s), kTwo);
    EXPECT_FALSE(outstanding.is_only(kThree));
    EXPECT_EQ(outstanding.last_sent(), at(2s));
}

TEST_F(OutstandingTest, ForgetsTheOldestOfTooMany) {
    for (std::size_t i = 0; i < OutstandingReplies::kMost + 2; ++i)
        outstanding.add(at(std::chrono::seconds(i)), kThree);
    EXPECT_EQ(outstanding.size(), OutstandingReplies::kMost);
    EXPECT_EQ(oldest(kReplyOfThree), at(2s));
}

TEST(ReconnectState, P4TriesAnotherLengthAgainAfterSixteenReplies) {
    ReconnectState state;
    state.on_probe_unanswered(true);
    for (int i = 0; i < 99; ++i) state.on_replied(false);
    for (int i = 0; i < 15; ++i) {
        state.on_replied(true);
        EXPECT_TRUE(state.only_known_reads()) << i;
    }
    state.on_replied(true);
    EXPECT_FALSE(state.only_known_reads()) << "it may just have been lost";
    state.on_probe_unanswered(true);
    state.on_replied(true);
    EXPECT_TRUE(state.only_known_reads());
}

TEST(BroadcastReplies, AreRememberedOfTheLastOnesAndConcernNoReads) {
    const Bytes to_all = "10 00 64 00 02 04 00 0A 01 02"_hex;
    const Bytes elsewhere = "10 00 68 00 02 04 00 0B 00 00"_hex;
    const auto to_one = request_of("10 00 64 00 02 04 00 0B 00 00"_hex);
    BroadcastReplies replies;
    EXPECT_EQ(replies.over(to_one, 1s), TimePoint{});
    replies.on_sent(at(1h), to_all);
    EXPECT_EQ(replies.over(to_one, 1s), at(1h + 1s));
    EXPECT_EQ(replies.over(request_of(kThree), 1s), TimePoint{});
    for (std::size_t i = 0; i + 1 < BroadcastReplies::kBroadcasts; ++i)
        replies.on_sent(at(1h + 1s), elsewhere);
    EXPECT_EQ(replies.over(to_one, 1s), at(1h + 1s));
    replies.on_sent(at(1h + 1s), elsewhere);
    EXPECT_EQ(replies.over(to_one, 1s), TimePoint{});
}

TEST(ForeignRequests, MatchWhatMayAnswerOneOfThem) {
    ForeignRequests requests;
    Bytes heard = encode_adu(17, "03 00 00 00 01"_hex);
    heard.push_back(0x55);  // more bytes follow
    requests.on_heard(at(1s), heard);
    EXPECT_TRUE(requests.fit(encode_adu(17, "03 02 00 07"_hex)));
    EXPECT_TRUE(requests.fit(encode_adu(17, kRefusal)));
    EXPECT_FALSE(requests.fit(encode_adu(18, "03 02 00 07"_hex)));
    EXPECT_FALSE(requests.fit(encode_adu(17, "03 04 00 07 00 08"_hex)));
    EXPECT_TRUE(requests.fit(encode_adu(17, kRefusal), at(1s)));
    EXPECT_FALSE(requests.fit(encode_adu(17, kRefusal), at(2s)));
    requests.clear();
    EXPECT_FALSE(requests.fit(encode_adu(17, kRefusal)));
}

TEST(ForeignRequests, ABroadcastHasNoAnswer) {
    ForeignRequests requests;
    requests.on_heard(at(1s), encode_adu(0, "06 00 01 00 03"_hex));
    EXPECT_FALSE(requests.fit(encode_adu(0, "06 00 01 00 03"_hex)));
}

TEST(ForeignRequests, ForgetTheOldestOfTooMany) {
    ForeignRequests requests;
    for (unsigned i = 1; i <= ForeignRequests::kMost + 1; ++i)
        requests.on_heard(at(1s), encode_adu(static_cast<std::uint8_t>(i), "03 00 00 00 01"_hex));
    EXPECT_FALSE(requests.fit(encode_adu(1, "03 02 00 07"_hex)));
    EXPECT_TRUE(requests.fit(encode_adu(2, "03 02 00 07"_hex)));
}

const Bytes kRequest = "03 00 6B 00 01"_hex;
const Bytes kOtherRequest = "03 00 6C 00 01"_hex;
const Bytes kReply = "03 02 00 01"_hex;
const Bytes kOtherReply = "03 02 00 02"_hex;
constexpr Duration kTooLate = timing::kLatestRepetition + 1ns;

class DuplicateGuardTest : public testing::Test {
  protected:
    void reply(const Bytes& pdu = kReply) {
        now_ += 1s;
        guard_.on_reply(now_, kRequest, pdu);
    }
    void unasked(Duration behind, const Bytes& pdu) { guard_.on_unasked(now_ + behind, pdu); }
    void confirm(const Bytes& request, const Bytes& pdu) {
        for (int i = 0; i < DuplicateGuard::kConfirmations; ++i) guard_.on_confirmed(request, pdu);
    }
    bool suspicious(Duration behind, const Bytes& request = kOtherRequest) const {
        return guard_.suspicious(now_ + behind, request, kReply);
    }

    DuplicateGuard guard_;
    TimePoint now_{1h};
};

TEST_F(DuplicateGuardTest, P1AnExactRepetitionOfARecentReplyIsADuplicate) {
    EXPECT_FALSE(guard_.is_duplicate(now_, kReply));
    reply();
    guard_.on_reply(now_ + 50ms, kOtherRequest, kOtherReply);
    EXPECT_TRUE(guard_.is_duplicate(now_ + 60ms, kReply)) << "also of the one before";
    EXPECT_TRUE(guard_.is_duplicate(now_ + 60ms, kOtherReply));
    EXPECT_FALSE(guard_.is_duplicate(now_ + 60ms, "03 02 00 03"_hex));
    EXPECT_FALSE(guard_.is_duplicate(now_ + kTooLate, kReply));
}

TEST_F(DuplicateGuardTest, P1OneDuplicateShowsThatTheStationSendsTwiceAndHowLongItMustRest) {
    reply();
    unasked(20ms, kReply);
    EXPECT_TRUE(guard_.known());
    EXPECT_GT(guard_.settle_time(), Duration(20ms));
    EXPECT_LT(guard_.settle_time(), Duration(60ms));
    for (const Duration behind : {80ms, 5ms}) {
        reply();
        unasked(behind, kReply);
        EXPECT_GT(guard_.settle_time(), Duration(80ms)) << "as long as the longest";
    }
}

TEST_F(DuplicateGuardTest, P1WhatOnlyHasTheShapeOfTheReplyHasToComeTwice) {
    reply();
    EXPECT_TRUE(guard_.is_second(now_ + 20ms, kOtherReply));
    unasked(20ms, kOtherReply);
    EXPECT_FALSE(guard_.known());
    reply();
    unasked(30ms, kOtherReply);
    EXPECT_TRUE(guard_.known());
    EXPECT_GT(guard_.settle_time(), Duration(30ms));
}

TEST_F(DuplicateGuardTest, WhatHasAnotherShapeOrComesLongAfterTeachesNothing) {
    for (int i = 0; i < 5; ++i) {
        reply();
        EXPECT_FALSE(guard_.is_second(now_ + 20ms, kReplyOfTwo));
        unasked(20ms, kReplyOfTwo);
        unasked(kTooLate, kReply);
    }
    EXPECT_FALSE(guard_.known());
    EXPECT_EQ(guard_.settle_time(), Duration(0));
}

TEST_F(DuplicateGuardTest, IsForgottenSomeMinutesAfterItStopped) {
    reply();
    unasked(20ms, kReply);
    const TimePoint last = now_;
    while (now_ < last + timing::kForgetDuplicates - 1s) reply();
    EXPECT_TRUE(guard_.known());
    for (int i = 0; i < 3; ++i) reply();
    EXPECT_FALSE(guard_.known());
}

TEST_F(DuplicateGuardTest, P1AnEqualAnswerToAnotherRequestIsSuspiciousForAMoment) {
    reply();
    EXPECT_TRUE(suspicious(20ms));
    EXPECT_FALSE(suspicious(20ms, kRequest));
    EXPECT_FALSE(guard_.suspicious(now_ + 20ms, kOtherRequest, kOtherReply));
    EXPECT_FALSE(suspicious(kTooLate));
}

TEST_F(DuplicateGuardTest, P1AStationThatWasSeenToGiveEqualAnswersIsBelievedUntilItSpeaksTwice) {
    reply();
    for (int i = 0; i < DuplicateGuard::kConfirmations; ++i) {
        EXPECT_TRUE(suspicious(20ms));
        guard_.on_confirmed(kOtherRequest, kReply);
    }
    EXPECT_FALSE(suspicious(20ms));
    unasked(20ms, kReply);
    EXPECT_TRUE(suspicious(30ms));
}

TEST_F(DuplicateGuardTest, P1EqualAnswersToWritesAndEqualExceptionsEarnNoTrustForValues) {
    reply();
    confirm("10 00 10 00 01 02 00 01"_hex, "10 00 10 00 01"_hex);
    EXPECT_TRUE(suspicious(20ms));
    confirm(kOtherRequest, "83 06"_hex);
    EXPECT_TRUE(suspicious(20ms));
}

/// The value may just have changed: only several in a row, within minutes, show a duplicate.
TEST_F(DuplicateGuardTest, P1AReplyDeniedThreeTimesWhenAskedOnceMoreWasADuplicate) {
    const auto deny = [&] {
        now_ += 1s;
        reply();
        guard_.on_denied(now_ + 20ms, kReply);
    };
    deny();
    deny();
    guard_.on_confirmed(kOtherRequest, kReply);
    deny();
    EXPECT_FALSE(guard_.known()) << "not in a row";
    now_ += timing::kForgetDuplicates + 1s;
    deny();
    deny();
    EXPECT_FALSE(guard_.known()) << "the first was long ago";
    deny();
    EXPECT_EQ(guard_.settle_time(), Duration(30ms));
}

TEST_F(DuplicateGuardTest, P1AStationThatIsDeniedIsNoLongerTrusted) {
    reply();
    confirm(kOtherRequest, kReply);
    EXPECT_FALSE(suspicious(20ms));
    guard_.on_denied(now_ + 20ms, kReply);
    EXPECT_TRUE(suspicious(20ms));
}

/// A panel whose empty registers are alike may still say its other replies twice.
TEST(EqualAnswers, P1ZerosSayNothingOfOtherValues) {
    EqualAnswers seen;
    for (int i = 0; i < EqualAnswers::kEnough; ++i) {
        EXPECT_FALSE(seen.trusts(kReply));
        seen.add(kReply);
    }
    EXPECT_TRUE(seen.trusts(kReply));
    EXPECT_FALSE(seen.trusts(kOtherReply));
    seen.add("03 02 00 03"_hex);
    EXPECT_FALSE(seen.trusts(kOtherReply));
    seen.add("03 02 00 04"_hex);
    EXPECT_TRUE(seen.trusts(kOtherReply)) << "it shows the same in several places";
}

TEST_F(DuplicateGuardTest, P1AfterADenialAnEqualAnswerToTheVerySameRequestIsSuspiciousToo) {
    reply();
    EXPECT_FALSE(suspicious(20ms, kRequest));
    guard_.on_denied(now_ + 20ms, kReply);
    EXPECT_TRUE(suspicious(40ms, kRequest));
    guard_.on_confirmed(kRequest, kReply);
    EXPECT_FALSE(suspicious(60ms, kRequest)) << "it has not changed";
    guard_.on_denied(now_ + 80ms, kReply);
    now_ += timing::kForgetDuplicates + 1s;
    reply();
    EXPECT_FALSE(suspicious(20ms, kRequest)) << "long ago";
}

TEST_F(DuplicateGuardTest, P1AStationThatAnswersOneRequestTwiceSendsDuplicates) {
    guard_.on_repeated_reply(now_ + 30ms, now_ + 10ms, kReply);
    EXPECT_EQ(guard_.settle_time(), Duration(30ms));
    reply();
    guard_.on_repeated_reply(now_ + 80ms, now_ + 50ms, kReply);
    EXPECT_EQ(guard_.settle_time(), Duration(45ms)) << "they come as late as that";
    guard_.on_repeated_reply(now_ + 50ms + timing::kLatestRepetition + 1ms, now_ + 50ms, kReply);
    EXPECT_EQ(guard_.settle_time(), Duration(45ms)) << "later, it is something else";
    guard_.on_repeated_reply(now_ + 130ms, now_ + 80ms, kReply);
    EXPECT_EQ(guard_.settle_time(), Duration(120ms))
        << "the first may have been a duplicate of the one before";
}

/// Once its own duplicate behind it passed for one of an earlier equal answer, half a second ago,
/// and the station rested for so long behind each reply.
TEST_F(DuplicateGuardTest, ADoubtedAnswerIsADuplicateOfNoneButEarlierOnes) {
    reply();
    guard_.on_reply(now_ + 400ms, kRequest, kReply);
    for (int i = 0; i < DuplicateGuard::kDenials; ++i) guard_.on_denied(now_ + 400ms, kReply);
    EXPECT_EQ(guard_.settle_time(), Duration(600ms));
    guard_ = {};
    reply();
    guard_.on_reply(now_ + 400ms, kRequest, kReply);
    guard_.on_unasked(now_ + 430ms, kReply);
    EXPECT_EQ(guard_.settle_time(), Duration(45ms));
}

TEST_F(DuplicateGuardTest, P1WhatIsInDoubtIsWaitedForBehindOneMoreReply) {
    reply();
    guard_.on_doubt(20ms);
    EXPECT_FALSE(guard_.known());
    EXPECT_GE(guard_.take_doubt(), Duration(20ms));
    EXPECT_EQ(guard_.take_doubt(), Duration(0));
}

TEST_F(DuplicateGuardTest, P1AStationRepeatsItselfAsSoonAsItsDuplicatesComeAndNotMuchLater) {
    reply();
    EXPECT_FALSE(guard_.repeats_itself(now_ + 1ms, kReply)) << "not known";
    unasked(20ms, kReply);
    EXPECT_TRUE(guard_.repeats_itself(now_ + 40ms, kReply));
    EXPECT_FALSE(guard_.repeats_itself(now_ + 40ms, kOtherReply));
    EXPECT_FALSE(guard_.repeats_itself(now_ + 100ms, kReply));
}

TEST_F(DuplicateGuardTest, P1FindsADuplicateAmidOtherBytes) {
    reply();
    Bytes amid = Writer().u8(0).u8(0xFF).raw(encode_adu(0x11, kReply)).take();
    EXPECT_NE(guard_.duplicate_in(now_ + 20ms, 0x11, amid), nullptr);
    EXPECT_EQ(guard_.duplicate_in(now_ + 20ms, 0x12, amid), nullptr);
    EXPECT_EQ(guard_.duplicate_in(now_ + kTooLate, 0x11, amid), nullptr);
    amid.back() ^= 1;
    EXPECT_EQ(guard_.duplicate_in(now_ + 20ms, 0x11, amid), nullptr)
        << "a damaged reply of equal values";
}

TEST_F(DuplicateGuardTest, ADuplicateIsOfTheLatestReplyThatItRepeats) {
    reply();
    guard_.on_reply(now_ + 200ms, kOtherRequest, kReply);
    unasked(220ms, kReply);
    EXPECT_TRUE(guard_.known());
    EXPECT_LT(guard_.settle_time(), Duration(60ms));
}

}  // namespace
}  // namespace panelgate::arbiter::outstanding_test
